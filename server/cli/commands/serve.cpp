// tind serve: the daemon. Reads its configuration, opens its datasets, wires the rooms together
// from the bottom up, and runs until it is told to stop.

#include <fcntl.h>
#include <fmt/format.h>
#include <malloc.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <map>
#include <stop_token>
#include <system_error>
#include <thread>

#include "server/api/app.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/surface_input.h"
#include "server/cli/program/dem_strips.h"
#include "server/log/log.h"
#include "server/log/printable.h"
#include "server/services/access/access_gate.h"
#include "server/services/datasets/catalog_folder.h"
#include "server/services/datasets/catalog_keeper.h"
#include "server/services/datasets/config.h"
#include "server/services/datasets/key_table.h"
#include "server/services/datasets/open_dataset.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/folder_entries.h"
#include "terrain/dataset/dem_dataset.h"
#include "terrain/dataset/stored_dataset.h"
#include "terrain/geo/environment.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/raster/nodata.h"
#include "terrain/raster/sandbox/lockdown.h"
#include "terrain/raster/sandboxed_pool.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/surface/open_surface.h"

namespace tind::cli {
namespace {

using services::Config;

constexpr std::chrono::milliseconds kToEnd{1000};  // after the last response, or the grace period
constexpr std::size_t kOpenFiles = 64;             // of DEMs, while nobody reads from them
constexpr std::size_t kSpareDescriptors = 192;     // DEM files, logs, libraries, a few connections
constexpr std::size_t kAdminConnections = 16;

struct Options {
  std::string config_file;
  std::map<std::string, std::string> flags;
  std::vector<std::string> datasets;
  SurfaceInput layers;
  bool check_config = false, print_config = false, no_core_dumps = false;
  std::shared_ptr<const Environment> environment;
};

std::vector<std::string> environment_names() {
  std::vector<std::string> names;
  for (char** entry = environ; *entry; ++entry)
    names.emplace_back(*entry, std::strcspn(*entry, "="));
  return names;
}

/// What --layer, --blend and --layer-error name: one dataset, called as its lowest layer.
Result<std::vector<services::DatasetSpec>> dataset_of_layers(const SurfaceInput& said) {
  if (said.layers.empty() && said.blends.empty() && said.layer_errors.empty() &&
      said.options.empty())
    return std::vector<services::DatasetSpec>{};
  if (said.layers.empty())
    return fail(Errc::invalid_argument,
                "--blend, --layer-error and --layer-option are of the layers that --layer names; "
                "those of datasets in a file are said there, [[dataset.layer]]");
  const auto read = read_layers(said, {});
  if (!read) return std::unexpected(read.error());
  services::DatasetSpec spec{.name = services::safe_name(read->layers.front().name), .files = {}};
  for (const LayerSpec& layer : read->layers) {
    spec.layers.push_back({layer.name, layer.files});
    spec.files.insert(spec.files.end(), layer.files.begin(), layer.files.end());
    if (read->options.blend_m >= 0)
      spec.layers.back().own["blend"] = fmt::format("{}", read->options.blend_m);
  }
  const auto say = [&](const char* key, const SurfaceOptions::OfLayer& one) -> Result<void> {
    const auto layer = std::ranges::find(spec.layers, one.name, &services::LayerTable::name);
    if (layer == spec.layers.end())
      return fail(Errc::invalid_argument,
                  fmt::format("there is no layer '{}' ({})", one.name, key));
    layer->own[key] = fmt::format("{}", one.metres);
    return {};
  };
  for (const auto& one : read->options.blends_m)
    if (auto said_it = say("blend", one); !said_it) return std::unexpected(said_it.error());
  for (const auto& one : read->options.max_errors_m)
    if (auto said_it = say("error", one); !said_it) return std::unexpected(said_it.error());
  for (const std::string& text : said.options) {  // NAME=OPTION:VALUE, as read_layers() has seen
    const auto equals = text.find('='), colon = text.find(':', equals);
    const auto layer =
        std::ranges::find(spec.layers, text.substr(0, equals), &services::LayerTable::name);
    layer->own[text.substr(equals + 1, colon - equals - 1)] = text.substr(colon + 1);
  }
  return std::vector{std::move(spec)};
}

/// A flag that is for DEMs, beside nothing but finished tiles, would be one that nobody hears.
Result<void> flags_are_heard(const Options& options, const Config& config) {
  const auto specs = services::specs_of(config);
  if (!config.catalog.empty() || specs.empty() || !std::ranges::all_of(specs, services::is_stored))
    return {};
  std::string unheard;
  for (const auto& [name, text] : options.flags)
    if (services::dataset_setting(name)) unheard += (unheard.empty() ? "--" : ", --") + name;
  if (unheard.empty()) return {};
  return fail(Errc::invalid_argument,
              specs[0].files[0] +
                  ": holds tiles, which are served as they were made; leave out what is for a "
                  "DEM: " +
                  unheard);
}

Result<Config> configure(const Options& options) {
  auto layers = dataset_of_layers(options.layers);
  if (!layers) return std::unexpected(layers.error());
  auto config = services::read_config(
      {.file = options.config_file,
       .environment = [](const std::string& key) -> std::optional<std::string> {
         const char* const value = std::getenv(key.c_str());
         return value ? std::optional<std::string>(value) : std::nullopt;
       },
       .environment_names = environment_names(),
       .flags = options.flags,
       .datasets = options.datasets,
       .tables = std::move(*layers)});
  if (!config) return config;
  if (auto heard = flags_are_heard(options, *config); !heard) return std::unexpected(heard.error());
  return config;
}

/// What would end a daemon by default although nobody wants it to end: a reader of its output that
/// has gone, and signals that it has no use for. SIGHUP has its handler once the server listens;
/// before that it is remembered.
std::atomic<bool> hung_up = false;
void ignore_signals() {
  for (const int signal : {SIGPIPE, SIGUSR1, SIGUSR2}) std::signal(signal, SIG_IGN);
  std::signal(SIGHUP, [](int) { hung_up = true; });
  // The first process of a container has no default actions: it would be deaf until it listens.
  if (::getpid() == 1)
    for (const int signal : {SIGTERM, SIGINT})
      std::signal(signal, [](int number) { std::_Exit(128 + number); });
}

bool has_terminal() {
  const int terminal = ::open("/dev/tty", O_RDONLY | O_CLOEXEC | O_NOCTTY);
  if (terminal >= 0) ::close(terminal);
  return terminal >= 0;
}

/// The process ends with this code even if a worker never looks at its stop token; where the system
/// has no thread for that, once all have looked.
void end_within(std::chrono::milliseconds time, int code) {
  const auto end = [time, code] {
    std::this_thread::sleep_for(time);
    constexpr std::string_view kWords = "tind: a worker did not stop in time and is abandoned\n";
    pollfd ready{2, POLLOUT, 0};
    if (::poll(&ready, 1, 0) > 0) [[maybe_unused]]
      const ssize_t size = ::write(2, kWords.data(), kWords.size());
    ::_exit(code);
  };
  try {
    std::thread(end).detach();
  } catch (const std::system_error&) {
  }
}

/// What libraries would take by themselves: an arena per thread keeps what was freed, so that with
/// many threads a daemon seems to leak. GDAL's block cache stands before one of our own.
void bound_memory() {
  // NOLINTBEGIN(concurrency-mt-unsafe): no other thread asks the environment yet
  mallopt(M_ARENA_MAX, 2);
  // A tile's work space stays for the next one: to take its pages anew each time was two thirds of
  // a cold tile's time. What is larger (a body, an index) goes back when it is done with.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 32 << 20);
  setenv("GDAL_CACHEMAX", "16", 0);  // MB; the operator's own setting wins
  // NOLINTEND(concurrency-mt-unsafe)
}

/// Folders of tiles keep theirs.
std::size_t open_descriptors() {
  const auto all = entries_of("/proc/self/fd");
  return all ? all->size() : 0;
}

/// As many descriptors as the system lets us have; the rest is what connections may use.
std::size_t connections_within_limits(std::size_t wanted) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return wanted;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
  getrlimit(RLIMIT_NOFILE, &limit);
  const std::size_t spare =
      std::min<std::size_t>(kSpareDescriptors + open_descriptors(), limit.rlim_cur / 2);
  return std::min<std::size_t>(wanted, limit.rlim_cur - spare);
}

/// What the operator should know of a DEM. Of one that is still being read there is only a sample.
void log_warnings(const DemSource& dem, bool is_read) {
  if (!is_read)
    (void)for_sample_blocks(dem, [](const HeightGrid&) {});  // a failure is found by who reads all
  if (const std::string line = undeclared_nodata_text(dem); !line.empty())
    spdlog::warn("{}", logging::printable(line));
}

void log_warnings(const services::ServedDataset& dataset, const TileSetOptions& options) {
  if (!dataset.source) return;
  const bool is_read =
      !dataset.tiles || dataset.tiles->readiness().state != Readiness::State::reading;
  for (const std::string& line : dataset.source->info().warnings)
    spdlog::warn("{}", logging::printable(line));
  if (const SurfaceShapes* const shapes = dataset.source->shapes())
    for (const std::string& line : shapes->report().warnings)
      spdlog::warn("{}: {}", dataset.name, logging::printable(line));
  for (const SurfaceLayer& layer : dataset.source->layers()) log_warnings(*layer.source, is_read);
  const auto plan = TilePlan::make(*dataset.source, HeightRange{}, options);
  const std::string warning = plan ? plan->warning(*dataset.source) : std::string();
  if (!warning.empty()) spdlog::warn("{}: {}", dataset.name, warning);
}

bool listens_here_alone(const std::string& listen) {
  const auto at = services::parse_listen(listen);
  return at->address.starts_with("127.") || at->address == "::1";
}

/// Whoever reaches an address of more than this machine may ask what has no key; empty: nobody else
/// does. `listen`: where the daemon does, whatever a configuration that was read since says.
std::string warning_of_strangers(const std::string& listen, const services::AccessRules& access) {
  if (listens_here_alone(listen) || !access.keys.empty()) return {};
  return fmt::format(
      "listening at {} without keys: whoever reaches it may ask everything (tind key new)", listen);
}

void warn_of_strangers(const std::string& listen, const services::AccessRules& access) {
  if (const auto text = warning_of_strangers(listen, access); !text.empty())
    spdlog::warn("{}", text);
}

/// For DEMs that the daemon reads and for those that processes of their own do, and a word of what
/// keeps a hostile one from doing harm.
std::shared_ptr<SourcePool> source_pool(const Config& config) {
  const auto said = config.every.find("sandbox");
  const std::string missing = sandbox::missing_text(sandbox::supported());
  const std::string how =
      said == config.every.end() ? services::dataset_setting("sandbox")->initial : said->second;
  if (how != "off" && !missing.empty())
    spdlog::warn("the sandbox for DEMs does without {}, which this system lacks", missing);
  // By this name also when the file was replaced since: both ends must be of one build.
  return sandboxed_pool(
      {.heights_bytes = std::size_t(config.source_cache_mb) << 20, .open_files = kOpenFiles},
      {.command = {"/proc/self/exe", kDecoderArgument},
       .nursery = {"/proc/self/exe", kNurseryArgument}});
}

services::CatalogKeeper::Settings keeper_settings(const Config& config, const Options& options,
                                                  std::shared_ptr<SourcePool> pool,
                                                  services::AccessGate& gate) {
  return {.read = [&options] { return configure(options); },
          .environment = options.environment,
          .pool = std::move(pool),
          .opened = [](const services::ServedDataset& dataset,
                       const services::DatasetOptions& how) { log_warnings(dataset, how.tiles); },
          .taken =
              [&gate, listen = config.listen](const Config& taken) {
                warn_of_strangers(listen, taken.access);
                gate.set(taken.access);
              }};
}

/// For which a start waits for files that somebody is writing into the catalog's folder.
constexpr std::chrono::milliseconds kMostRest{5000};

/// Who starts a daemon, or checks its configuration, sees every reason why it does not start.
std::unexpected<Error> cannot_be_served(const std::vector<Error>& bad) {
  if (bad.size() == 1) return std::unexpected(bad[0]);
  for (const Error& error : bad) complain(error);
  return fail(bad[0].code, fmt::format("{} datasets cannot be served, for the reasons above; mend "
                                       "them or leave them out",
                                       bad.size()));
}

/// The first load.
Result<void> load_all(services::CatalogKeeper& keeper) {
  const auto loaded = keeper.load();
  if (loaded) return {};
  return cannot_be_served(loaded.error());
}

Result<http::StaticFiles> load_viewer(const Config& config, const Environment& environment) {
  const std::string directory =
      config.viewer.empty() ? environment.data_dir() + "/viewer" : config.viewer;
  auto files = http::StaticFiles::load(directory);
  if (files) return files;
  if (!config.viewer.empty()) return fail("viewer", files.error());
  spdlog::warn("no viewer in {}: serving data only", directory);
  return http::StaticFiles();
}

http::ServerOptions server_options(const Config& config, bool had_terminal) {
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
  options.origins = *services::origins_of(config.cors_origins);
  options.hangup_stops = [had_terminal] { return had_terminal && !has_terminal(); };
  options.drain_delay = milliseconds(config.drain_delay);
  options.grace = milliseconds(config.grace);
  return options;
}

/// Where long work for clients is done; nothing where there is to be none.
Result<std::unique_ptr<services::Jobs>> open_jobs(const Config& config) {
  if (config.jobs == 0) return nullptr;
  const auto megabytes = [](int mb) { return std::size_t(mb) << 20; };
  // This very program, whatever lies under its name by then.
  const std::string program = "/proc/self/exe";
  const std::chrono::seconds time(config.jobs_seconds);
  const int per_client = config.jobs_stored_mb_per_client > 0
                             ? config.jobs_stored_mb_per_client
                             : std::max(config.jobs_stored_mb / 2, config.jobs_result_mb);
  auto jobs = services::Jobs::open(config.jobs_dir, program,
                                   {.running = config.jobs,
                                    .waiting = std::size_t(config.jobs_waiting),
                                    .per_client = std::size_t(config.jobs_per_client),
                                    .stored_bytes = megabytes(config.jobs_stored_mb),
                                    .stored_per_client = megabytes(per_client),
                                    .kept = std::chrono::hours(config.jobs_kept_hours),
                                    .each = {.memory_bytes = megabytes(config.jobs_memory_mb),
                                             .file_bytes = megabytes(config.jobs_result_mb),
                                             .cpu_time = time,
                                             .wall_time = time}});
  if (!jobs && !config.jobs_dir.empty()) return fail("jobs-dir", jobs.error());
  if (jobs) return jobs;
  // Nobody asked for them by name: a daemon that may write nowhere serves all the same.
  spdlog::warn("no jobs, no /processes: {}", logging::printable(jobs.error().what));
  return nullptr;
}

/// The operator's own listener; nothing where there is to be none.
Result<std::unique_ptr<http::Server>> listen_for_admin(const Config& config,
                                                       const http::Router& router) {
  if (config.admin_listen.empty()) return nullptr;
  const auto where = services::parse_admin_listen(config.admin_listen);
  http::ServerOptions options;
  options.address = where->address;
  options.port = where->port;
  options.socket = where->socket;
  options.threads = 1;
  options.limits.connections = options.limits.per_address = kAdminConnections;
  options.access_log = config.access_log;
  options.handle_signals = false;
  options.grace = std::chrono::milliseconds(200);  // less than kToEnd
  auto server = http::Server::listen(router, options);
  if (!server) return fail("admin-listen", server.error());
  return server;
}

std::string index_dir_of(const Config& config) {
  return config.index_dir.empty() ? services::default_index_dir() : config.index_dir;
}

/// Whether that folder, or the one in which it would be made, may be written to.
Result<void> check_writable(const char* setting, const std::string& folder) {
  if (folder.empty()) return {};
  std::error_code error;
  std::filesystem::path there = std::filesystem::absolute(folder, error);
  while (there.has_relative_path() && ::access(there.c_str(), F_OK) != 0 && errno == ENOENT)
    there = there.parent_path();
  if (::faccessat(AT_FDCWD, there.c_str(), W_OK | X_OK, AT_EACCESS) == 0) return {};
  return fail(Errc::io, fmt::format("{}: {}: {}", setting, there.string(), errno_text(errno)));
}

int serve(const Config& config, const Options& options) {
  bound_memory();
  const bool had_terminal = has_terminal();
  const logging::Log log(config.log_level,
                         config.log_format == "json" ? logging::Form::json : logging::Form::text);
  if (config.access_log && config.log_level != "info" && config.log_level != "debug")
    spdlog::warn("no access log: its lines are information, of which log-level {} has none",
                 config.log_level);
  services::Catalog catalog;
  services::AccessGate gate;
  services::CatalogKeeper keeper(catalog,
                                 keeper_settings(config, options, source_pool(config), gate));
  if (!config.catalog.empty()) services::wait_for_rest(config.catalog, kMostRest);
  if (auto loaded = load_all(keeper); !loaded) return complain(loaded.error());
  auto viewer = load_viewer(config, *options.environment);
  if (!viewer) return complain(viewer.error());

  services::TileCache cache(std::size_t(config.cache_mb) << 20);
  services::CpuPool pool(config.build_threads, std::size_t(config.queue));
  services::TileService tiles(cache, pool);
  services::TileStreams streams(tiles, cache, pool);
  services::TileTransitions transitions(tiles, cache, pool);
  services::TileEncodings encodings(tiles, cache, pool);
  services::Tiles3d tiles3d(tiles, cache, pool);
  services::Scenery scenery(cache, pool, *options.environment);
  services::HeightImages images(tiles, cache, pool);
  services::RefineService refine;
  api::App app{catalog, tiles, cache, pool, *viewer, *options.environment};
  app.refine = &refine;
  app.streams = &streams;
  app.transitions = &transitions;
  app.encodings = &encodings;
  app.images = &images;
  app.keeper = &keeper;
  app.tiles3d = &tiles3d;
  app.scenery = &scenery;
  app.gate = &gate;
  // Behind keys a page needs one; and what names others on the network know it by, nobody has said.
  if (!config.hosts.empty() || (listens_here_alone(config.listen) && config.access.keys.empty()))
    app.job_pages = {services::hosts_of(config.hosts), *services::origins_of(config.cors_origins)};
  auto jobs = open_jobs(config);
  if (!jobs) return complain(jobs.error());
  if (auto ok = check_writable("index-dir", index_dir_of(config)); !ok)
    spdlog::warn("large DEMs will not be ready: {}", logging::printable(ok.error().what));
  app.jobs = jobs->get();
  const http::Router router = api::make_router(app);
  const http::Router admin_router =
      api::make_admin_router(app, !config.admin_listen.starts_with("unix:"));
  auto listening = server_options(config, had_terminal);
  listening.on_hangup = [&keeper] { keeper.reload(); };
  auto server = http::Server::listen(router, listening);
  if (!server) return complain(server.error());
  app.server = server->get();
  auto admin = listen_for_admin(config, admin_router);
  if (!admin) return complain(admin.error());
  // Before anybody is told where it listens: where they cannot be begun there is no daemon.
  std::jthread admin_loop([&](const std::stop_token& stop) {
    if (!*admin) return;
    const std::stop_callback at_end(stop, [&] { (*admin)->stop(); });
    (*admin)->run();
  });
  std::jthread follower([&](const std::stop_token& stop) { keeper.run(stop); });

  std::printf("tind: serving %zu datasets at %s\n", catalog.all().size(), (*server)->url().c_str());
  // Whoever waits for that line would wait for ever, unless he has gone.
  if (std::fflush(stdout) != 0 && errno != EPIPE)
    return complain(Error{Errc::io, fmt::format("cannot say where it listens: standard output: {}",
                                                errno_text(errno))});
  if (*admin) spdlog::info("admin at {}", (*admin)->url());
  if (hung_up && listening.hangup_stops())
    (*server)->stop();
  else if (hung_up)
    keeper.reload();
  const int code = (*server)->run() ? kOk : kTryAgain;
  end_within(kToEnd, code);
  follower.request_stop();
  if (*jobs) (*jobs)->stop();  // first: a load that goes on may take longer than there is time for
  follower.join();
  admin_loop.request_stop();  // whoever asked for that load has its answer
  admin_loop.join();
  pool.stop();  // before the server goes: what waits here answers through it
  spdlog::info("stopped");
  return code;
}

/// How many DEMs of one dataset are not read at the start, and not here: 0 or 1.
Result<std::size_t> check_dataset(services::DatasetSpec spec, const Config& config,
                                  const std::shared_ptr<const Environment>& environment) {
  auto files = services::files_of(spec);
  if (!files) return std::unexpected(files.error());
  spec.files = std::move(*files);
  auto options = services::dataset_options(config.every, spec.own);
  if (!options) return std::unexpected(options.error());
  options->dem.environment = environment;
  if (services::is_stored(spec)) {
    if (auto dataset = stored_dataset(spec.files[0]); !dataset)
      return std::unexpected(dataset.error());
    return 0;
  }
  const auto opened = services::open_source(spec, options->dem);
  if (!opened) return std::unexpected(opened.error());
  const auto source = shaped_surface(*opened, options->shapes);
  if (!source) return std::unexpected(source.error());
  if (source->post_count() > kMostReadAtOnce) return 1;
  if (auto dataset = dem_dataset(*source, options->tiles); !dataset)
    return std::unexpected(dataset.error());
  return 0;
}

struct Checked {
  std::size_t not_read = 0;    // DEMs that a start reads later
  std::size_t left_alone = 0;  // entries of the catalog
};

/// What would end the start: all that is read before the daemon is ready, and of a DEM that it
/// reads later that it opens. What a start would leave alone is a warning.
Result<Checked> check(const Config& config, const std::shared_ptr<const Environment>& environment) {
  if (auto any = services::something_to_serve(config); !any) return std::unexpected(any.error());
  Checked all;
  std::vector<Error> bad;
  for (const services::DatasetSpec& spec : services::specs_of(config)) {
    const auto checked = check_dataset(spec, config, environment);
    if (!checked) bad.push_back(checked.error());
    all.not_read += checked.value_or(0);
  }
  if (!bad.empty()) return cannot_be_served(bad);
  if (!config.catalog.empty()) {
    const auto entries = services::CatalogFolder(config.catalog).look();
    if (!entries) return std::unexpected(entries.error());
    for (const services::FolderEntry& entry : *entries) {
      const auto checked = entry.wrong.empty()
                               ? check_dataset(entry.spec, config, environment)
                               : Result<std::size_t>(fail(Errc::bad_data, entry.wrong));
      if (!checked) warn("left alone: " + checked.error().what);
      all.left_alone += !checked;
      all.not_read += checked.value_or(0);
    }
  }
  if (std::error_code none;
      !config.viewer.empty() && !std::filesystem::is_directory(config.viewer, none))
    return fail(Errc::not_found, "viewer: there is no folder " + config.viewer);
  if (config.jobs > 0)
    if (auto ok = check_writable("jobs-dir", config.jobs_dir); !ok)
      warn("this user cannot start it: " + ok.error().what);
  if (auto ok = check_writable("index-dir", index_dir_of(config)); !ok)
    warn("for this user large DEMs will not be ready: " + ok.error().what);
  return all;
}

constexpr const char* kAsRoot =
    "will not serve as root: whoever took it over would have the machine; start it as a user of "
    "its own, or say --as-root";
bool refused_as_root(const Config& config) { return ::geteuid() == 0 && !config.as_root; }

int run(const Options& options) {
  if (!options.check_config && !options.print_config) ignore_signals();
  if (const rlimit none{0, 0}; options.no_core_dumps) ::setrlimit(RLIMIT_CORE, &none);
  const auto config = configure(options);
  if (!config) return complain(config.error());
  const auto checked = options.check_config ? check(*config, options.environment) : Checked{};
  if (!checked) return complain(checked.error());
  if (checked->not_read > 0)
    warn(fmt::format("{} DEMs of more than {} million posts were opened, but not read",
                     checked->not_read, kMostReadAtOnce / 1'000'000));
  if (options.check_config && refused_as_root(*config))
    warn(std::string("as this user it ") + kAsRoot);
  if (options.check_config)
    if (const auto text = warning_of_strangers(config->listen, config->access); !text.empty())
      warn(text);
  if (options.print_config) std::fputs(services::print_config(*config).c_str(), stdout);
  if (checked->left_alone > 0)
    return complain({Errc::bad_data, fmt::format("the settings are valid, but {} of the catalog's "
                                                 "entries would not be served",
                                                 checked->left_alone)});
  if (options.check_config && !options.print_config) std::puts("tind: the configuration is valid");
  if (options.print_config || options.check_config) return kOk;
  if (refused_as_root(*config)) return complain(Error{Errc::invalid_argument, kAsRoot});
  return serve(*config, options);
}

}  // namespace

void add_serve(Command program, int& exit) {
  auto options = std::make_shared<Options>();
  Command command = program.add_subcommand(
      "serve", "Serve DEMs (tiled on demand) and directories of tiles over HTTP");
  options->environment = command.environment();
  command.add_option(
      "dataset", options->datasets,
      "DEM, directory or archive of tiles; NAME=FILE[,FILE...] names it and joins several files");
  add_layer_options(command, options->layers);
  command.add_option("--config", options->config_file, "TOML file with the settings below");
  for (const services::Setting& setting : services::settings()) {
    const std::string initial = setting.show(Config{});
    const std::string help =
        setting.is_switch || initial == "\"\"" ? setting.help : setting.help + " [" + initial + "]";
    const auto store = [options, name = setting.name](const std::string& value) {
      options->flags[name] = value;
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
