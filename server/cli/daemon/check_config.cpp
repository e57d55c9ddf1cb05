#include "server/cli/daemon/check_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>

#include "server/cli/daemon/daemon_parts.h"
#include "server/cli/daemon/daemon_process.h"
#include "server/cli/program/exit.h"
#include "server/log/log.h"
#include "server/services/datasets/catalog_folder.h"
#include "terrain/pyramid/make/dem_tiles.h"

namespace tind::cli {
namespace {

using services::Config;

constexpr std::chrono::milliseconds kToEnd{1000};  // for what is being opened still

/// Of folders that are made at the start.
Result<void> check_folders(const Config& config) {
  if (auto ok = check_writable("index-dir", services::index_dir_of(config.index_dir)); !ok)
    warn("for this user large DEMs will not be ready: " + ok.error().what);
  if (config.jobs == 0) return {};
  if (auto ok = check_writable("jobs-dir", config.jobs_dir); !ok) {
    if (ok.error().code != Errc::io) return fail(Errc::io, ok.error().what);
    warn("this user cannot start it: " + ok.error().what);
  }
  return {};
}

std::size_t count_of_unread(const services::Catalog& catalog) {
  return std::size_t(std::ranges::count_if(catalog.all(), [](const auto& dataset) {
    return dataset->tiles && dataset->tiles->readiness().state == Readiness::State::reading;
  }));
}

Result<void> look(services::CatalogKeeper& keeper, const services::Catalog& catalog,
                  const Config& config) {
  if (!config.catalog.empty()) services::wait_for_rest(config.catalog, kMostRest);
  const auto loaded = load_all(keeper);
  if (!loaded) return std::unexpected(loaded.error());
  if (std::error_code none;
      !config.viewer.empty() && !std::filesystem::is_directory(config.viewer, none))
    return fail(Errc::not_found, "viewer: there is no folder " + config.viewer);
  for (const auto& [entry, why] : loaded->aside) warn("left alone: " + why);
  for (const std::string& entry : loaded->waiting)
    warn(entry + ": is being written, or takes long to open: nothing is known of it yet");
  if (auto ok = check_folders(config); !ok) return ok;
  if (const std::size_t unread = count_of_unread(catalog); unread > 0)
    warn(fmt::format("{} DEMs of more than {} million posts were opened, but not read", unread,
                     kMostReadAtOnce / 1'000'000));
  if (const auto text = warning_of_strangers(config.listen, config.access); !text.empty())
    warn(text);
  if (loaded->aside.empty()) return {};
  return fail(Errc::bad_data, fmt::format("the settings are valid, but {} of the catalog's entries "
                                          "would not be served",
                                          loaded->aside.size()));
}

}  // namespace

int check_config(const Config& config, const DaemonOptions& options,
                 const std::function<int(const Result<void>&)>& say) {
  const logging::Log quiet("off");  // what is to be known is said here, once
  services::Catalog catalog;
  services::CatalogKeeper keeper(
      catalog,
      {.read = [&options] { return configure(options); },
       .environment = options.environment,
       .pool = source_pool(config),
       .opened =
           [](const services::ServedDataset& dataset, const services::DatasetOptions& how) {
             for (const std::string& line : warnings_of(dataset, how)) warn(line);
           },
       .keeps_indexes = false});
  const int code = say(look(keeper, catalog, config));
  std::fflush(stdout);
  end_within(kToEnd, code);
  return code;
}

}  // namespace tind::cli
