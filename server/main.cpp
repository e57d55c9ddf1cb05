// tind: the table of subcommands.

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>
#include <cstdio>
#include <exception>

#include "server/cli/commands.h"

#ifndef TIND_VERSION
#define TIND_VERSION "0"
#endif

int main(int argc, char** argv) {
  CLI::App app{
      "tind: terrain meshes whose error is known. DEMs in, simplified TINs and tiles out."};
  app.set_version_flag("--version", "tind " TIND_VERSION);
  app.require_subcommand(1);
  int exit = tind::cli::kOk;
  // subcommands: one line each
  tind::cli::add_simplify(app, exit);
  tind::cli::add_refine(app, exit);
  tind::cli::add_progressive(app, exit);
  tind::cli::add_extract(app, exit);
  tind::cli::add_between(app, exit);
  tind::cli::add_measure(app, exit);
  tind::cli::add_compare(app, exit);
  tind::cli::add_methods(app, exit);
  tind::cli::add_info(app, exit);
  tind::cli::add_build(app, exit);
  tind::cli::add_check(app, exit);
  tind::cli::add_estimate(app, exit);
  tind::cli::add_explain(app, exit);
  tind::cli::add_plan(app, exit);
  tind::cli::add_serve(app, exit);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? tind::cli::kOk : tind::cli::kUsage;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "tind: internal error: %s\n", e.what());
    return tind::cli::kInternal;
  }
  return exit;
}
