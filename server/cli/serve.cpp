// tind serve: the daemon. Reads its configuration, opens its datasets, wires the rooms together
// from the bottom up, and runs until it is told to stop.

#include <malloc.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>

#include "server/api/app.h"
#include "server/cli/commands.h"
#include "server/services/config.h"
#include "server/services/open_dataset.h"

namespace tind::cli {
namespace {

using services::Config;

constexpr std::size_t kSpareDescriptors = 64;  // DEM files, logs, libraries

struct Options {
  std::string config_file;
  std::map<std::string, std::string> flags;
  std::vector<std::string> datasets;
  bool check_config = false, print_config = false;
};

Result<Config> configure(const Options& options) {
  return services::read_config(
      {.file = options.config_file,
       .environment = [](const std::string& key) -> std::optional<std::string> {
         const char* const value = std::getenv(key.c_str());
         return value ? std::optional<std::string>(value) : std::nullopt;
       },
       .flags = options.flags,
       .datasets = options.datasets});
}

void start_log(const Config& config) {
  spdlog::set_default_logger(spdlog::stderr_logger_mt("tind"));
  spdlog::set_pattern("%Y-%m-%dT%H:%M:%S.%e%z %l %v");
  spdlog::set_level(spdlog::level::from_str(config.log_level));
}

/// What libraries would take by themselves: an arena per thread keeps what was freed, so that with
/// many threads a daemon seems to leak. GDAL's block cache stands before one of our own.
void bound_memory() {
  mallopt(M_ARENA_MAX, 2);
  mallopt(M_MMAP_THRESHOLD, 256 << 10);  // work space goes back to the system when it is done with
  setenv("GDAL_CACHEMAX", "16", 0);      // MB; the operator's own setting wins
}

/// As many descriptors as the system lets us have; the rest is what connections may use.
std::size_t connections_within_limits(std::size_t wanted) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return wanted;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  getrlimit(RLIMIT_NOFILE, &limit);
  const std::size_t spare = std::min<std::size_t>(kSpareDescriptors, limit.rlim_cur / 2);
  return std::min<std::size_t>(wanted, limit.rlim_cur - spare);
}

VerticalDatum datum_named(const std::string& text) {
  if (text == "egm96") return VerticalDatum::egm96;
  return text == "ellipsoid" ? VerticalDatum::ellipsoid : VerticalDatum::unknown;
}

Result<services::Catalog> open_datasets(const Config& config) {
  if (config.datasets.empty())
    return fail(Errc::invalid_argument,
                "nothing to serve: name a DEM or a directory of tiles (see tind serve --help)");
  DemOptions dem;
  dem.from_datum = datum_named(config.from_datum);
  dem.to_datum = config.to_datum == "same" ? TargetDatum::same : TargetDatum::ellipsoid;
  dem.allow_vrt = config.allow_vrt;
  dem.cache_bytes = (std::size_t(config.source_cache_mb) << 20) / config.datasets.size();
  TileSetOptions tiles;
  tiles.max_error_m = config.max_error;
  tiles.error_factor = config.error_factor;
  tiles.side = config.side;
  services::Catalog catalog;
  for (const std::string& text : config.datasets)
    if (auto opened = open_dataset(
            catalog, services::parse_dataset_spec(text), dem, tiles,
            config.index_dir.empty() ? services::default_index_dir() : config.index_dir);
        !opened)
      return std::unexpected(opened.error());
  return catalog;
}

std::string viewer_directory(const Config& config) {
  if (!config.viewer.empty()) return config.viewer;
  if (const char* data = std::getenv("TIND_DATA")) return std::string(data) + "/viewer";
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  return (program.parent_path().parent_path() / "share/tind/viewer").string();
}

Result<http::StaticFiles> load_viewer(const Config& config) {
  const std::string directory = viewer_directory(config);
  auto files = http::StaticFiles::load(directory);
  if (files || !config.viewer.empty()) return files;
  spdlog::warn("no viewer in {}: serving data only", directory);
  return http::StaticFiles();
}

http::ServerOptions server_options(const Config& config) {
  const auto listen = services::parse_listen(config.listen);
  const auto milliseconds = [](double seconds) {
    return std::chrono::milliseconds(std::llround(seconds * 1000));
  };
  http::ServerOptions options;
  options.address = listen->address;
  options.port = listen->port;
  options.threads = config.threads;
  options.limits.connections = connections_within_limits(std::size_t(config.max_connections));
  options.access_log = config.access_log;
  options.drain_delay = milliseconds(config.drain_delay);
  options.grace = milliseconds(config.grace);
  return options;
}

int serve(const Config& config) {
  bound_memory();
  start_log(config);
  auto catalog = open_datasets(config);
  if (!catalog) return complain(catalog.error());
  auto viewer = load_viewer(config);
  if (!viewer) return complain(viewer.error());

  services::TileCache cache(std::size_t(config.cache_mb) << 20);
  services::CpuPool pool(config.build_threads, std::size_t(config.queue));
  services::TileService tiles(cache, pool);
  services::TileStreams streams(tiles, cache, pool);
  services::TileTransitions transitions(tiles, cache, pool);
  services::RefineService refine;
  api::App app{*catalog, tiles, cache, pool, *viewer};
  app.refine = &refine;
  app.streams = &streams;
  app.transitions = &transitions;
  const http::Router router = api::make_router(app);
  auto server = http::Server::listen(router, server_options(config));
  if (!server) return complain(server.error());
  app.server = server->get();

  std::printf("tind: serving %zu datasets at %s\n", catalog->all().size(),
              (*server)->url().c_str());
  std::fflush(stdout);
  (*server)->run();
  pool.stop();  // before the server goes: what waits here answers through it
  spdlog::info("stopped");
  return kOk;
}

int run(const Options& options) {
  const auto config = configure(options);
  if (!config) return complain(config.error());
  if (options.print_config) std::fputs(services::print_config(*config).c_str(), stdout);
  if (options.check_config && !options.print_config) std::puts("tind: the configuration is valid");
  if (options.print_config || options.check_config) return kOk;
  return serve(*config);
}

}  // namespace

void add_serve(CLI::App& program, int& exit) {
  auto options = std::make_shared<Options>();
  CLI::App* const command = program.add_subcommand(
      "serve", "Serve DEMs (tiled on demand) and directories of tiles over HTTP");
  command->add_option("dataset", options->datasets,
                      "DEM or directory; NAME=FILE[,FILE...] names it and joins several files");
  command->add_option("--config", options->config_file, "TOML file with the settings below");
  for (const services::Setting& setting : services::settings()) {
    const auto store = [options, name = setting.name](const std::string& value) {
      options->flags[name] = value;
    };
    if (setting.is_switch) {
      command->add_flag_function(
          "--" + setting.name, [store](std::int64_t) { store("true"); }, setting.help);
    } else {
      command->add_option_function<std::string>("--" + setting.name, store, setting.help);
    }
  }
  command->add_flag("--check-config", options->check_config, "only say whether it is valid");
  command->add_flag("--print-config", options->print_config, "print it, with every default");
  command->callback([options, &exit] { exit = run(*options); });
}

}  // namespace tind::cli
