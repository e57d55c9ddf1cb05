#include "server/cli/daemon/run_daemon.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <stop_token>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include "server/api/app.h"
#include "server/cli/daemon/daemon_parts.h"
#include "server/cli/daemon/daemon_process.h"
#include "server/cli/daemon/service_manager.h"
#include "server/cli/program/exit.h"
#include "server/log/log.h"
#include "server/log/printable.h"
#include "server/services/access/access_gate.h"
#include "server/services/datasets/catalog_folder.h"
#include "server/services/datasets/catalog_keeper.h"
#include "server/services/datasets/key_table.h"
#include "terrain/base/errno_text.h"
#include "terrain/raster/sandbox/lockdown.h"

namespace tind::cli {
namespace {

using services::Config;

constexpr std::chrono::milliseconds kToEnd{1000};  // after the last response, or the grace period
constexpr std::size_t kAdminConnections = 16;

void warn_of_strangers(const std::string& listen, const services::AccessRules& access) {
  if (const auto text = warning_of_strangers(listen, access); !text.empty())
    spdlog::warn("{}", text);
}

/// What keeps a hostile DEM from doing harm, and is not there.
void warn_of_missing_fences(const Config& config) {
  const auto said = config.every.find("sandbox");
  const std::string missing = sandbox::missing_text(sandbox::supported());
  const std::string how =
      said == config.every.end() ? services::dataset_setting("sandbox")->initial : said->second;
  if (how != "off" && !missing.empty())
    spdlog::warn("the sandbox for DEMs does without {}, which this system lacks", missing);
}

/// A socket that was handed over stands in place of what the settings say, whatever they say later.
Config listening_there(Config config, const ServiceManager& manager) {
  if (manager.socket) config.listen = manager.socket->address;
  return config;
}

services::CatalogKeeper::Settings keeper_settings(const Config& config,
                                                  const DaemonOptions& options,
                                                  const ServiceManager& manager,
                                                  services::AccessGate& gate) {
  return {.read = [&options, &manager]() -> Result<Config> {
            auto now = configure(options);
            if (!now) return now;
            return listening_there(std::move(*now), manager);
          },
          .environment = options.environment,
          .pool = source_pool(config),
          .opened =
              [](const services::ServedDataset& dataset, const services::DatasetOptions& how) {
                for (const std::string& line : warnings_of(dataset, how))
                  spdlog::warn("{}", logging::printable(line));
              },
          .taken =
              [&gate, listen = config.listen](const Config& taken) {
                warn_of_strangers(listen, taken.access);
                gate.set(taken.access);
              }};
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
  options.signals_to_the_end = true;  // a second SIGTERM changes no exit code any more
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

}  // namespace

int run_daemon(const Config& read, const DaemonOptions& options) {
  const auto manager = take_service_manager();
  if (!manager) return complain(manager.error());
  const Config config = listening_there(read, *manager);
  bound_memory();
  const bool had_terminal = has_terminal();
  const logging::Log log(config.log_level,
                         config.log_format == "json" ? logging::Form::json : logging::Form::text);
  if (config.access_log && config.log_level != "info" && config.log_level != "debug")
    spdlog::warn("no access log: its lines are information, of which log-level {} has none",
                 config.log_level);
  services::Catalog catalog;
  services::AccessGate gate;
  warn_of_missing_fences(config);
  services::CatalogKeeper keeper(catalog, keeper_settings(config, options, *manager, gate));
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
  if (auto ok = check_writable("index-dir", services::index_dir_of(config.index_dir)); !ok)
    spdlog::warn("large DEMs will not be ready: {}", logging::printable(ok.error().what));
  app.jobs = jobs->get();
  // Jobs run elsewhere. Where it has no whole name, theirs is the default one.
  std::error_code error;
  if (const std::string folder = services::index_dir_of(config.index_dir); !folder.empty())
    app.index_dir = std::filesystem::absolute(folder, error).string();
  const http::Router router = api::make_router(app);
  const http::Router admin_router =
      api::make_admin_router(app, !config.admin_listen.starts_with("unix:"));
  auto listening = server_options(config, had_terminal);
  if (manager->socket) listening.listener = manager->socket->descriptor;
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
  if (const auto told = tell_ready(*manager); !told)
    spdlog::warn("{}", logging::printable(told.error().what));
  if (has_hung_up() && listening.hangup_stops())
    (*server)->stop();
  else if (has_hung_up())
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

}  // namespace tind::cli
