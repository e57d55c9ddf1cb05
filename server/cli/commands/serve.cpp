// tind serve: the daemon, and what it would do.

#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <memory>
#include <string>

#include "server/cli/commands/commands.h"
#include "server/cli/daemon/check_config.h"
#include "server/cli/daemon/daemon_options.h"
#include "server/cli/daemon/daemon_process.h"
#include "server/cli/daemon/run_daemon.h"
#include "server/cli/options/surface_input.h"
#include "server/cli/program/exit.h"
#include "server/services/datasets/config.h"
#include "terrain/base/errno_text.h"

namespace tind::cli {
namespace {

struct Options {
  DaemonOptions daemon;
  bool check_config = false, print_config = false, no_core_dumps = false;
};

constexpr const char* kAsRoot =
    "will not serve as root: whoever took it over would have the machine; start it as a user of "
    "its own, or say --as-root";

int run(const Options& options) {
  const bool runs = !options.check_config && !options.print_config;
  if (runs) ignore_signals();
  if (const rlimit none{0, 0}; options.no_core_dumps && ::setrlimit(RLIMIT_CORE, &none) != 0)
    return complain(Error{Errc::io, "--no-core-dumps: " + errno_text(errno)});
  const auto config = configure(options.daemon);
  if (!config) return complain(config.error());
  const bool refused = ::geteuid() == 0 && !config->as_root;
  if (runs)
    return refused ? complain(Error{Errc::invalid_argument, kAsRoot})
                   : run_daemon(*config, options.daemon);
  const std::string printed = options.print_config ? services::print_config(*config) : "";
  const auto say = [&](const Result<void>& checked) {
    if (options.check_config && refused) warn(std::string("as this user it ") + kAsRoot);
    if (!checked) return complain(checked.error());
    std::fputs(options.print_config ? printed.c_str() : "tind: the configuration is valid\n",
               stdout);
    return int(kOk);
  };
  return options.check_config ? check_config(*config, options.daemon, say) : say({});
}

}  // namespace

void add_serve(Command program, int& exit) {
  auto options = std::make_shared<Options>();
  Command command = program.add_subcommand(
      "serve", "Serve DEMs (tiled on demand) and directories of tiles over HTTP");
  options->daemon.environment = command.environment();
  command.add_option(
      "dataset", options->daemon.datasets,
      "DEM, directory or archive of tiles; NAME=FILE[,FILE...] names it and joins several files");
  add_layer_options(command, options->daemon.layers);
  command.add_option("--config", options->daemon.config_file, "TOML file with the settings below");
  for (const services::Setting& setting : services::settings()) {
    const std::string initial = setting.show(services::Config{});
    const std::string help =
        setting.is_switch || initial == "\"\"" ? setting.help : setting.help + " [" + initial + "]";
    const auto store = [options, name = setting.name](const std::string& value) {
      options->daemon.flags[name] = value;
    };
    if (setting.is_switch) {
      command.add_switch("--" + setting.name, store, help);
    } else {
      command.add_function("--" + setting.name, store, help);
    }
  }
  command.add_flag(
      "--check-config", options->check_config,
      "only say whether it is valid and its datasets can be served; DEMs of more than 33 "
      "million posts are opened, but not read");
  command.add_flag("--no-core-dumps", options->no_core_dumps,
                   "leave no core file behind, which would hold keys' hashes and clients' data");
  command.add_flag("--print-config", options->print_config, "print it, with every default");
  command.on_run([options, &exit] { exit = run(*options); });
}

}  // namespace tind::cli
