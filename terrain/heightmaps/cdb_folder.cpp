#include "terrain/heightmaps/cdb_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <vector>

#include "proto/image/tiff.h"
#include "terrain/base/file_io.h"
#include "terrain/base/hash.h"
#include "terrain/raster/raster_file.h"
#include "terrain/store/folder/folder_contents.h"
#include "terrain/store/folder/folder_files.h"
#include "terrain/store/folder/folder_lock.h"
#include "terrain/store/folder/product_records.h"

namespace tind::cdb {
namespace {

namespace fs = std::filesystem;

constexpr int kEpoch = 1;  // to be raised when bytes change
constexpr std::size_t kMostTiles = 500'000;

constexpr const char* kWgs84 = R"(GEOGCRS["WGS 84",DATUM["World Geodetic System 1984",)"
                               R"(ELLIPSOID["WGS 84",6378137,298.257223563]],CS[ellipsoidal,2],)"
                               R"(AXIS["latitude",north],AXIS["longitude",east],)"
                               R"(ANGLEUNIT["degree",0.0174532925199433],ID["EPSG",4326]])";

/// Two runs with the same record make the same files.
std::string record_of(const Surface& surface) {
  return "Elevations by tind " + std::to_string(kEpoch) + " of source " +
         hash128(surface.info().fingerprint).text() + "\n";
}

/// One run at a time in a folder, which is made if need be.
Result<FolderLock> take_lock(const std::string& folder) {
  if (auto done = FolderFiles().make_folder(folder); !done) return std::unexpected(done.error());
  return FolderLock::take(folder);
}

/// The folder is ours and of the same, or new or empty: then it is claimed now, which is the
/// answer.
Result<bool> claim(const std::string& folder, const std::string& record) {
  const std::string path = folder + kCdbRecord;
  const auto kept = read_regular_file(path);
  if (kept && *kept == record) return false;
  if (kept)
    return fail(Errc::invalid_argument, folder +
                                            " holds elevations of another source, or by another "
                                            "version of tind: choose another directory");
  // What cannot be read may be ours: only what is not there says that nothing is.
  if (kept.error().code != Errc::not_found) return std::unexpected(kept.error());
  const auto fresh = folder::is_unclaimed(folder, kCdbRecord);
  if (!fresh) return fresh;
  if (!*fresh)
    return fail(Errc::invalid_argument,
                folder +
                    " holds files that tind export did not make: choose another directory, "
                    "and copy the folder Tiles from there");
  if (auto done = remove_partials_of(path); !done) return std::unexpected(done.error());
  if (auto done = write_whole_file(path, record); !done) return std::unexpected(done.error());
  return true;
}

/// An area whose east may be beyond 180, as rectangles of the globe.
std::vector<GeoRect> on_the_globe(const GeoRect& area) {
  if (area.east <= 180) return {area};
  std::vector<GeoRect> parts{{-180, area.south, area.east - 360, area.north}};
  if (area.west < 180) parts.push_back({area.west, area.south, 180, area.north});
  return parts;
}

/// Where there may be posts.
std::vector<GeoRect> areas_of(const Surface& surface, const std::optional<GeoRect>& within) {
  std::vector<GeoRect> areas;
  const auto parts = on_the_globe(within.value_or(GeoRect{-180, -90, 180, 90}));
  for (const SurfaceLayer& layer : surface.layers()) {
    const DemInfo& info = layer.source->info();
    std::vector<GeoRect> rects = info.extents;
    if (rects.empty()) rects = {info.bounds};
    for (const GeoRect& r : rects)
      for (const GeoRect& part : parts) {
        const GeoRect both{std::max(r.west, part.west), std::max(r.south, part.south),
                           std::min(r.east, part.east), std::min(r.north, part.north)};
        if (both.west < both.east && both.south < both.north) areas.push_back(both);
      }
  }
  return areas;
}

std::unexpected<Error> too_many(int deepest) {
  return fail(Errc::invalid_argument,
              fmt::format("--lod {}: more than {} tiles; take a coarser level, or less with "
                          "--bounds",
                          deepest, kMostTiles));
}

/// Parents before their children, each once.
Result<std::vector<Tile>> tiles_of(const std::vector<GeoRect>& areas, int deepest) {
  std::vector<Tile> all;
  std::set<std::string> seen;
  for (const GeoRect& area : areas) {
    // Level 0 has a tile for each geocell of about a degree, and each level four times as many.
    const double cells = (area.width() + 1) * (area.height() + 1);
    const double inside = area.width() * area.height() * std::exp2(2 * std::max(deepest, 0));
    if (cells + inside > double(kMostTiles)) return too_many(deepest);
    for (const Tile& tile : tiles(area, deepest))
      if (seen.insert(path(tile)).second) all.push_back(tile);
    if (all.size() > kMostTiles) return too_many(deepest);
  }
  std::ranges::stable_sort(all, {}, &Tile::lod);
  return all;
}

int deepest_of(const Surface& surface) {
  double finest = HUGE_VAL;
  for (const SurfaceLayer& layer : surface.layers()) finest = std::min(finest, layer.finest_m());
  return level_of(finest);
}

Result<void> put(const Surface& surface, const Tile& tile, const FolderOptions& options,
                 const std::stop_token& stop, FolderReport& report) {
  const fs::path file = fs::path(options.output) / path(tile);
  if (const auto there = read_regular_file(file.string()); there && proto::is_whole_tiff(*there)) {
    ++report.kept, report.bytes += there->size();
    return {};
  }
  auto made = lattice_heights(surface, lattice(tile), {true, options.threads}, {{}, stop});
  if (!made) return fail(path(tile), made.error());
  report.posts += made->heights.size(), report.without_height += made->without_height;
  report.max_deviation_m = std::max(report.max_deviation_m, made->max_deviation_m);
  const auto bytes = encode_tile(tile, surface.info().datum, std::move(made->heights));
  if (!bytes) return fail(path(tile), bytes.error());
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  if (error)
    return fail(Errc::io, "cannot create " + file.parent_path().string() + ": " + error.message());
  report.bytes += bytes->size();
  return write_whole_file(file.string(), *bytes);
}

/// And the folders that hold nothing else. What is not there, or not empty, stays as it is.
void remove_tiles(const std::string& folder, const std::vector<Tile>& all) {
  std::error_code ignored;
  for (const Tile& tile : all) {
    fs::path at = path(tile);
    fs::remove(fs::path(folder) / at, ignored);
    while (!(at = at.parent_path()).empty() && fs::remove(fs::path(folder) / at, ignored)) {
    }
  }
}

}  // namespace

Result<std::string> encode_tile(const Tile& tile, const VerticalDatum& datum,
                                std::vector<float> heights) {
  const GeoRect r = rect(tile);
  const int n = posts(tile.lod);
  DemInfo info;
  info.cols = info.rows = n;
  info.has_geotransform = true;
  info.post_to_crs = {r.west, r.width() / n,  0, r.south + (n - 1) * (r.height() / n),
                      0,      -r.height() / n};
  info.crs_kind = CrsKind::geographic;
  info.crs_wkt = kWgs84;
  info.datum = datum;
  const auto rows = [&](int row, int count) -> Result<HeightGrid> {
    HeightGrid grid(n, count);
    std::copy_n(heights.begin() + std::ptrdiff_t(row) * n, std::size_t(n) * std::size_t(count),
                grid.values().begin());
    return grid;
  };
  auto made = encode_raster(
      RasterFormat::geotiff, info,
      {.what = "elevation", .packing = RasterPacking::lzw, .voids = false, .points = true}, rows);
  if (!made) return std::unexpected(made.error());
  return std::move(made->bytes);
}

Result<FolderReport> write_folder(const Surface& surface, const FolderOptions& options,
                                  const Progress& progress) {
  FolderReport report;
  report.deepest = options.deepest.value_or(deepest_of(surface));
  const auto listed = tiles_of(areas_of(surface, options.area), report.deepest);
  if (!listed) return std::unexpected(listed.error());
  const std::vector<Tile>& all = *listed;
  if (all.empty() && options.area)
    return fail(Errc::invalid_argument, "--bounds leaves nothing of the DEM");
  if (all.empty())
    return fail(Errc::invalid_argument,
                "the DEM has one column or one row of posts: there is no area between them that "
                "tiles could have");
  const auto held = take_lock(options.output);
  if (!held) return std::unexpected(held.error());
  const auto claimed_now = claim(options.output, record_of(surface));
  if (!claimed_now) return std::unexpected(claimed_now.error());
  for (const Tile& tile : all) {
    if (progress.stopped())
      return fail(Errc::cancelled, "stopped before all tiles were written: run again to go on");
    if (auto done = put(surface, tile, options, progress.stop, report); !done)
      return std::unexpected(done.error());
    ++report.tiles;
    progress.at(double(report.tiles) / double(all.size()));
  }
  if (report.kept == 0 && report.without_height == report.posts) {
    remove_tiles(options.output, all);
    std::error_code ignored;
    if (*claimed_now) fs::remove(options.output + kCdbRecord, ignored);
    return fail(Errc::bad_data,
                fmt::format("no height at any post of levels {} to {}, so all {} tiles would be 0: "
                            "the DEM is void there, or too small for these levels",
                            kCoarsest, report.deepest, report.tiles));
  }
  return report;
}

}  // namespace tind::cdb
