#include "server/cli/daemon/daemon_parts.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "server/cli/program/dem_strips.h"
#include "server/cli/program/exit.h"
#include "terrain/base/errno_text.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/raster/nodata.h"
#include "terrain/raster/sandboxed_pool.h"
#include "terrain/shapes/surface_shapes.h"

namespace tind::cli {
namespace {

constexpr std::size_t kOpenFiles = 64;  // of DEMs, while nobody reads from them

/// Empty: nothing. Of one that is still being read there is only a sample.
std::string warning_of(const DemSource& dem, bool is_read) {
  if (!is_read)
    (void)for_sample_blocks(dem, [](const HeightGrid&) {});  // a failure is found by who reads all
  return undeclared_nodata_text(dem);
}

/// Who starts a daemon, or checks its configuration, sees every reason why it does not start.
std::unexpected<Error> cannot_be_served(const std::vector<Error>& bad) {
  if (bad.size() == 1) return std::unexpected(bad[0]);
  for (const Error& error : bad) complain(error);
  return fail(bad[0].code, fmt::format("{} datasets cannot be served, for the reasons above; mend "
                                       "them or leave them out",
                                       bad.size()));
}

}  // namespace

std::shared_ptr<SourcePool> source_pool(const services::Config& config) {
  // By this name also when the file was replaced since: both ends must be of one build.
  return sandboxed_pool(
      {.heights_bytes = std::size_t(config.source_cache_mb) << 20, .open_files = kOpenFiles},
      {.command = {"/proc/self/exe", kDecoderArgument},
       .nursery = {"/proc/self/exe", kNurseryArgument}});
}

std::vector<std::string> warnings_of(const services::ServedDataset& dataset,
                                     const services::DatasetOptions& how) {
  if (!dataset.source) return {};
  const bool is_read =
      !dataset.tiles || dataset.tiles->readiness().state != Readiness::State::reading;
  std::vector<std::string> lines = dataset.source->info().warnings;
  if (const SurfaceShapes* const shapes = dataset.source->shapes())
    for (const std::string& line : shapes->report().warnings)
      lines.push_back(dataset.name + ": " + line);
  for (const SurfaceLayer& layer : dataset.source->layers())
    if (std::string line = warning_of(*layer.source, is_read); !line.empty())
      lines.push_back(std::move(line));
  const auto plan = TilePlan::make(*dataset.source, HeightRange{}, how.tiles);
  const std::string warning = plan ? plan->warning(*dataset.source) : std::string();
  if (!warning.empty()) lines.push_back(dataset.name + ": " + warning);
  return lines;
}

bool listens_here_alone(const std::string& listen) {
  const std::string address = services::parse_listen(listen)->address;
  in_addr v4{};
  in6_addr v6{};
  if (::inet_pton(AF_INET, address.c_str(), &v4) == 1) return ntohl(v4.s_addr) >> 24 == 127;
  if (::inet_pton(AF_INET6, address.c_str(), &v6) != 1) return false;
  return IN6_IS_ADDR_LOOPBACK(&v6) || (IN6_IS_ADDR_V4MAPPED(&v6) && v6.s6_addr[12] == 127);
}

std::string warning_of_strangers(const std::string& listen, const services::AccessRules& access) {
  if (listens_here_alone(listen) || !access.keys.empty()) return {};
  return fmt::format(
      "listening at {} without keys: whoever reaches it may ask everything (tind key new)", listen);
}

Result<services::CatalogChange> load_all(services::CatalogKeeper& keeper) {
  auto loaded = keeper.load();
  if (loaded) return std::move(*loaded);
  return cannot_be_served(loaded.error());
}

Result<void> check_writable(const char* setting, const std::string& folder) {
  if (folder.empty()) return {};
  std::error_code error;
  std::filesystem::path there = std::filesystem::absolute(folder, error);
  while (there.has_relative_path() && ::access(there.c_str(), F_OK) != 0 && errno == ENOENT)
    there = there.parent_path();
  int why = 0;
  if (!std::filesystem::is_directory(there, error))
    why = error ? error.value() : ENOTDIR;
  else if (::faccessat(AT_FDCWD, there.c_str(), W_OK | X_OK, AT_EACCESS) != 0)
    why = errno;
  if (why == 0) return {};
  const bool may_others = why == EACCES || why == EPERM || why == EROFS;
  return fail(may_others ? Errc::io : Errc::invalid_argument,
              fmt::format("{}: {}: {}", setting, there.string(), errno_text(why)));
}

}  // namespace tind::cli
