// tind formats: which mesh formats there are, and what each can carry.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "terrain/mesh/mesh_file.h"

namespace tind::cli {

namespace {

const char* ways(const MeshFormat& f) {
  return f.encode && f.decode ? "read, write" : f.encode ? "write" : "read";
}

void print_json() {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const MeshFormat& f : mesh_formats())
    all.push_back({{"name", f.name},
                   {"extensions", f.extensions},
                   {"title", f.title},
                   {"writes", f.encode != nullptr},
                   {"reads", f.decode != nullptr},
                   {"coordinates", f.numbers},
                   {"crs", f.crs},
                   {"attributes", attributes_of(f)},
                   {"meant_for", f.meant_for}});
  std::printf("%s\n", json::to_text(all, 2).c_str());
}

void print_table() {
  fmt::print("{:<8} {:<15} {:<12} {}\n", "format", "extension", "tind can", "what");
  for (const MeshFormat& f : mesh_formats())
    fmt::print("{:<8} {:<15} {:<12} {}\n", f.name, fmt::format("{}", fmt::join(f.extensions, " ")),
               ways(f), f.title);
  for (const MeshFormat& f : mesh_formats())
    fmt::print("\n{}\n  coordinates  {}\n  CRS          {}\n  attributes   {}\n  meant for    {}\n",
               f.name, f.numbers, f.crs, attributes_of(f), f.meant_for);
  fmt::print(
      "\nThe extension of -o says the format, else --format. With --frame metric, x and y are in "
      "no\n"
      "CRS: the file then names the origin and how metres become coordinates, where it has room "
      "for\n"
      "text. Rasters of a mesh: 'tind simplify --raster' and '--error-raster'.\n");
}

}  // namespace

void add_formats(Command program, int& exit) {
  auto json = std::make_shared<bool>(false);
  Command app = program.add_subcommand("formats", "List the formats of meshes");
  app.add_flag("--json", *json, "as JSON");
  app.on_run([json, &exit] {
    *json ? print_json() : print_table();
    exit = kOk;
  });
}

}  // namespace tind::cli
