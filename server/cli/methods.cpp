// tind methods: what each method minimises, where it can stop, what it guarantees.

#include "server/api/methods.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "server/cli/commands.h"
#include "terrain/simplify/simplify.h"

namespace tind::cli {

namespace {

void print_methods(bool json) {
  if (json) {
    std::fputs(api::methods_json().c_str(), stdout);
    return;
  }
  for (const MethodInfo& m : methods()) {
    fmt::print("{}\n  minimises   {}\n  stops at    {}\n  guarantees  {}\n  source      {}\n",
               m.name, m.minimises, m.stops, m.guarantees, m.source);
  }
}

}  // namespace

void add_methods(CLI::App& program, int& exit) {
  auto json = std::make_shared<bool>(false);
  CLI::App* app = program.add_subcommand("methods", "List the methods of 'tind simplify'");
  app->add_flag("--json", *json, "as JSON");
  app->callback([json, &exit] {
    print_methods(*json);
    exit = kOk;
  });
}

}  // namespace tind::cli
