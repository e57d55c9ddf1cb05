// tind serve: the daemon. Reads its configuration, opens its datasets, wires the rooms together
// from the bottom up, and runs until it is told to stop.

#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <thread>

#include "server/api/app.h"
#include "server/cli/commands/commands.h"
#include "server/cli/program/dem_strips.h"
#include "server/log/log.h"
#include "server/log/printable.h"
#include "server/services/datasets/config.h"
#include "server/services/datasets/open_dataset.h"
#include "terrain/dataset/dem_dataset.h"
#include "terrain/dataset/stored_dataset.h"
#include "terrain/geo/environment.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/raster/nodata.h"

namespace tind::cli {
namespace {

using services::Config;

constexpr std::chrono::milliseconds kToEnd{1000};  // after the last response, or the grace period
constexpr std::size_t kSpareDescriptors = 128;     // DEM files, logs, libraries, a few connections

struct Options {
  std::string config_file;
  std::map<std::string, std::string> flags;
  std::vector<std::string> datasets;
  bool check_config = false, print_config = false;
  std::shared_ptr<const Environment> environment;
};

std::vector<std::string> environment_names() {
  std::vector<std::string> names;
  for (char** entry = environ; *entry; ++entry)
    names.emplace_back(*entry, std::strcspn(*entry, "="));
  return names;
}

Result<Config> configure(const Options& options) {
  return services::read_config(
      {.file = options.config_file,
       .environment = [](const std::string& key) -> std::optional<std::string> {
         const char* const value = std::getenv(key.c_str());
         return value ? std::optional<std::string>(value) : std::nullopt;
       },
       .environment_names = environment_names(),
       .flags = options.flags,
       .datasets = options.datasets});
}

/// What would end a daemon by default although nobody wants it to end: a reader of its output that
/// has gone, and signals that it has no use for. SIGHUP has its handler once the server listens.
void ignore_signals() {
  for (const int signal : {SIGPIPE, SIGUSR1, SIGUSR2, SIGHUP}) std::signal(signal, SIG_IGN);
}

bool has_terminal() {
  const int terminal = ::open("/dev/tty", O_RDONLY | O_CLOEXEC | O_NOCTTY);
  if (terminal >= 0) ::close(terminal);
  return terminal >= 0;
}

/// The process ends with this code even if a worker never looks at its stop token.
void end_within(std::chrono::milliseconds time, int code) {
  std::thread([time, code] {
    std::this_thread::sleep_for(time);
    constexpr std::string_view kWords = "tind: a worker did not stop in time and is abandoned\n";
    pollfd ready{2, POLLOUT, 0};
    if (::poll(&ready, 1, 0) > 0) [[maybe_unused]]
      const ssize_t size = ::write(2, kWords.data(), kWords.size());
    ::_exit(code);
  }).detach();
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

/// What the operator should know of a DEM. Of one that is still being read there is only a sample.
void log_warnings(const services::ServedDataset& dataset) {
  if (!dataset.source) return;
  for (const std::string& line : dataset.source->info().warnings)
    spdlog::warn("{}", logging::printable(line));
  for (const SurfaceLayer& layer : dataset.source->layers()) {
    if (dataset.tiles && dataset.tiles->readiness().state == Readiness::State::reading)
      (void)for_sample_blocks(*layer.source, [](const HeightGrid&) {});  // who reads all, reports
    if (const std::string line = undeclared_nodata_text(*layer.source); !line.empty())
      spdlog::warn("{}", logging::printable(line));
  }
}

Result<void> something_to_serve(const Config& config) {
  if (!config.datasets.empty() || !config.tables.empty()) return {};
  return fail(Errc::invalid_argument,
              "nothing to serve: name a DEM or a directory of tiles (see tind serve --help)");
}

std::vector<services::DatasetSpec> specs_of(const Config& config) {
  std::vector<services::DatasetSpec> specs;
  for (const std::string& text : config.datasets)
    specs.push_back(services::parse_dataset_spec(text));
  specs.insert(specs.end(), config.tables.begin(), config.tables.end());
  return specs;
}

Result<services::DatasetOptions> options_of(const Config& config, const services::DatasetSpec& spec,
                                            std::shared_ptr<const Environment> environment) {
  auto options = services::dataset_options(config.every, spec.own);
  if (!options) return options;
  options->dem.environment = std::move(environment);
  options->dem.cache_bytes =
      (std::size_t(config.source_cache_mb) << 20) / (config.datasets.size() + config.tables.size());
  return options;
}

Result<services::Catalog> open_datasets(const Config& config,
                                        const std::shared_ptr<const Environment>& environment) {
  if (auto any = something_to_serve(config); !any) return std::unexpected(any.error());
  services::Catalog catalog;
  std::vector<Error> bad;
  const auto specs = specs_of(config);
  for (const services::DatasetSpec& spec : specs) {
    const auto options = options_of(config, spec, environment);
    if (!options) return std::unexpected(options.error());
    auto dataset =
        open_dataset(spec, *options,
                     config.index_dir.empty() ? services::default_index_dir() : config.index_dir);
    if (!dataset) {
      bad.push_back(dataset.error());
      continue;
    }
    const auto& added = catalog.add(name_of(spec), std::move(*dataset));
    log_warnings(added);
    const Surface* const source = added.source.get();
    const auto plan = source ? TilePlan::make(*source, HeightRange{}, options->tiles)
                             : fail(Errc::not_found, "tiles as they were built");
    const std::string warning = plan ? plan->warning(*source) : std::string();
    if (!warning.empty()) spdlog::warn("{}: {}", added.name, warning);
  }
  if (bad.empty()) return catalog;
  if (bad.size() == 1 && specs.size() == 1) return std::unexpected(bad[0]);
  for (const Error& error : bad) complain(error);
  return fail(bad[0].code, fmt::format("{} of {} datasets cannot be served, for the reasons above; "
                                       "mend them or leave them out",
                                       bad.size(), specs.size()));
}

Result<http::StaticFiles> load_viewer(const Config& config, const Environment& environment) {
  const std::string directory =
      config.viewer.empty() ? environment.data_dir() + "/viewer" : config.viewer;
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
  options.limits.per_address = config.max_connections_per_address > 0
                                   ? std::size_t(config.max_connections_per_address)
                                   : std::max<std::size_t>(1, options.limits.connections / 4);
  options.buffer_bytes = std::size_t(config.buffer_mb) << 20;
  options.access_log = config.access_log;
  options.hangup_stops = [had_terminal = has_terminal()] {
    return had_terminal && !has_terminal();
  };
  options.drain_delay = milliseconds(config.drain_delay);
  options.grace = milliseconds(config.grace);
  return options;
}

/// Updates of folders that are served, once a second.
void follow(services::Catalog& catalog, const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any wait;
  std::unique_lock lock(mutex);
  while (!wait.wait_for(lock, stop, std::chrono::seconds(1), [&] { return stop.stop_requested(); }))
    for (const std::string& name : catalog.follow())
      spdlog::info("{}: its folder has got other tiles, which are served from now on", name);
}

int serve(const Config& config, const std::shared_ptr<const Environment>& environment) {
  bound_memory();
  ignore_signals();
  const logging::Log log(config.log_level);
  if (::geteuid() == 0)
    spdlog::warn(
        "running as root: DEM files are decoded in this process; a user of its own is safer");
  auto catalog = open_datasets(config, environment);
  if (!catalog) return complain(catalog.error());
  auto viewer = load_viewer(config, *environment);
  if (!viewer) return complain(viewer.error());

  services::TileCache cache(std::size_t(config.cache_mb) << 20);
  services::CpuPool pool(config.build_threads, std::size_t(config.queue));
  services::TileService tiles(cache, pool);
  services::TileStreams streams(tiles, cache, pool);
  services::TileTransitions transitions(tiles, cache, pool);
  services::TileEncodings encodings(tiles, cache, pool);
  services::RefineService refine;
  api::App app{*catalog, tiles, cache, pool, *viewer, *environment};
  app.refine = &refine;
  app.streams = &streams;
  app.transitions = &transitions;
  app.encodings = &encodings;
  const http::Router router = api::make_router(app);
  auto server = http::Server::listen(router, server_options(config));
  if (!server) return complain(server.error());
  app.server = server->get();

  std::printf("tind: serving %zu datasets at %s\n", catalog->all().size(),
              (*server)->url().c_str());
  std::fflush(stdout);
  const std::jthread follower([&](const std::stop_token& stop) { follow(*catalog, stop); });
  const int code = (*server)->run() ? kOk : kTryAgain;
  end_within(kToEnd, code);
  pool.stop();  // before the server goes: what waits here answers through it
  spdlog::info("stopped");
  return code;
}

/// What would end the start: all that is read before the daemon is ready, and of a DEM that it
/// reads later that it opens. The sum is of those.
Result<std::size_t> check(const Config& config,
                          const std::shared_ptr<const Environment>& environment) {
  if (auto any = something_to_serve(config); !any) return std::unexpected(any.error());
  std::size_t not_read = 0;
  for (services::DatasetSpec spec : specs_of(config)) {
    auto files = services::files_of(spec);
    if (!files) return std::unexpected(files.error());
    spec.files = std::move(*files);
    const auto options = options_of(config, spec, environment);
    if (!options) return std::unexpected(options.error());
    if (services::is_stored(spec)) {
      if (auto dataset = stored_dataset(spec.files[0]); !dataset)
        return std::unexpected(dataset.error());
    } else if (auto dem = services::open_source(spec, options->dem); !dem) {
      return std::unexpected(dem.error());
    } else if (dem->post_count() > kMostReadAtOnce) {
      ++not_read;
    } else if (auto dataset = dem_dataset(*dem, options->tiles); !dataset) {
      return std::unexpected(dataset.error());
    }
  }
  if (!config.viewer.empty() && !std::filesystem::is_directory(config.viewer))
    return fail(Errc::not_found, "viewer: there is no folder " + config.viewer);
  return not_read;
}

int run(const Options& options) {
  const auto config = configure(options);
  if (!config) return complain(config.error());
  Result<std::size_t> not_read =
      options.check_config ? check(*config, options.environment) : Result<std::size_t>(0);
  if (!not_read) return complain(not_read.error());
  if (*not_read > 0)
    warn(fmt::format("{} DEMs of more than {} million posts were opened, but not read", *not_read,
                     kMostReadAtOnce / 1'000'000));
  if (options.print_config) std::fputs(services::print_config(*config).c_str(), stdout);
  if (options.check_config && !options.print_config) std::puts("tind: the configuration is valid");
  if (options.print_config || options.check_config) return kOk;
  return serve(*config, options.environment);
}

}  // namespace

void add_serve(Command program, int& exit) {
  auto options = std::make_shared<Options>();
  Command command = program.add_subcommand(
      "serve", "Serve DEMs (tiled on demand) and directories of tiles over HTTP");
  options->environment = command.environment();
  command.add_option("dataset", options->datasets,
                     "DEM or directory; NAME=FILE[,FILE...] names it and joins several files");
  command.add_option("--config", options->config_file, "TOML file with the settings below");
  for (const services::Setting& setting : services::settings()) {
    const auto store = [options, name = setting.name](const std::string& value) {
      options->flags[name] = value;
    };
    if (setting.is_switch) {
      command.add_action(
          "--" + setting.name, [store] { store("true"); }, setting.help);
    } else {
      command.add_function("--" + setting.name, store, setting.help);
    }
  }
  command.add_flag(
      "--check-config", options->check_config,
      "only say whether it is valid and its datasets can be served; DEMs of more than 33 "
      "million posts are opened, but not read");
  command.add_flag("--print-config", options->print_config, "print it, with every default");
  command.on_run([options, &exit] { exit = run(*options); });
}

}  // namespace tind::cli
