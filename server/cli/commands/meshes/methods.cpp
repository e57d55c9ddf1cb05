// tind methods: a table to choose by, then what each method minimises, takes and guarantees.

#include "server/api/methods.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "server/cli/commands/commands.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/options.h"

namespace tind::cli {

namespace {

void print_methods(bool json) {
  if (json) {
    std::fputs(api::methods_json().c_str(), stdout);
    return;
  }
  fmt::print("{:<18} {:<58} {:>5} {:>5} {:>6}\n", "method", "take it for", "time", "RMS", "tiles");
  for (const MethodInfo& m : methods())
    fmt::print("{:<18} {:<58} {:>5} {:>5} {:>6}\n", m.name, m.take_for, m.time, m.rms,
               m.tiles ? "yes" : "no");
  fmt::print(
      "\nWithout --method it is {}: within an error it has the fewest triangles, at a count the\n"
      "smallest RMS error. Meshes (PLY, OBJ, STL ...) take qem, attribute-qem and "
      "triangle-collapse;\n"
      "there it is {}. Terrain that is a mesh (--terrain) takes all but cluster.\n"
      "Time and RMS error are those beside qem's at 10 % of the triangles.\n\n"
      "All of them: no triangle flips; every valid post is covered; --max-error holds at every\n"
      "covered post; --triangles and --ratio are never exceeded, or the note says why.\n"
      "voids: all cover them (--voids cover), so that no valid post is left out. 'tind simplify\n"
      "--voids keep' leaves them open, and counts the valid posts that have no cell of three "
      "valid\n"
      "corners beside them, which no triangle can cover then. In 'tind progressive' voids stay "
      "open.\n"
      "tiles: 'tind build --method' and the daemon make tiles by it, all with the same borders "
      "and\n"
      "within the same error, voids closed.\n",
      method_name(MethodOptions{}), DefaultMeshMethod::kName);
  for (const MethodInfo& m : methods()) {
    std::string options;
    for (const std::string& o : m.options) options += (options.empty() ? "--" : ", --") + o;
    fmt::print(
        "\n{}\n  minimises   {}\n  stops at    {}\n  guarantees  {}\n  options     {}\n  "
        "source      {}\n",
        m.name, m.minimises, m.stops, m.guarantees, options.empty() ? "none" : options, m.source);
  }
}

}  // namespace

void add_methods(Command program, int& exit) {
  auto json = std::make_shared<bool>(false);
  Command app = program.add_subcommand("methods", "List the methods of 'tind simplify'");
  app.add_flag("--json", *json, "as JSON");
  app.on_run([json, &exit] {
    print_methods(*json);
    exit = kOk;
  });
}

}  // namespace tind::cli
