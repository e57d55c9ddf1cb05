#include "server/cli/options/raster_output.h"

#include <filesystem>

#include "server/cli/options/output_turn.h"
#include "server/cli/program/exit.h"
#include "terrain/base/file_io.h"
#include "terrain/base/file_there.h"
#include "terrain/mesh/mesh_raster.h"

namespace tind::cli {

namespace {

std::string prj_beside(const std::string& path) {
  return std::filesystem::path(path).replace_extension(".prj").string();
}

}  // namespace

Result<void> can_lie_there(const std::string& path, const DemInfo& info) {
  if (info.crs_kind != CrsKind::none || raster_format(path) != RasterFormat::ascii_grid) return {};
  const auto there = is_there(prj_beside(path));
  if (!there) return std::unexpected(there.error());
  if (!*there) return {};
  return fail(Errc::invalid_argument, prj_beside(path) +
                                          " is there, and the DEM has no CRS: remove it, or choose "
                                          "another name for " +
                                          path);
}

Result<void> write_raster(const std::string& path, const RasterBytes& made) {
  if (made.prj.empty()) return write_whole_file(path, made.bytes);
  const auto turn = OutputTurn::take(path);
  if (!turn) return std::unexpected(turn.error());
  if (auto ok = write_whole_file(path, made.bytes); !ok) return ok;
  return write_whole_file(prj_beside(path), made.prj);
}

namespace {

int write_one(const std::string& path, bool heights, const DemInfo& info, const Tin& mesh,
              const RasterRows& posts, int threads) {
  const auto rows = [&](int row, int count) -> Result<HeightGrid> {
    const auto strip = posts(row, count);
    if (!strip) return std::unexpected(strip.error());
    MeshRaster raster = mesh_raster(mesh, *strip, row, threads);
    return heights ? std::move(raster.heights) : std::move(raster.errors);
  };
  const auto made = encode_raster(
      *raster_format(path), info,
      {.heights = heights, .what = heights ? "height of the mesh" : "mesh - DEM"}, rows);
  if (!made) return complain(made.error());
  const auto ok = write_raster(path, *made);
  return ok ? int(kOk) : complain(ok.error());
}

}  // namespace

void add_raster_output(Command app, RasterOutput& output) {
  app.add_option("--raster", output.heights,
                 "also the mesh's height at every post, metres: .tif, or .asc with a .prj");
  app.add_option("--error-raster", output.errors,
                 "also mesh - post at every post, metres: .tif or .asc; no data where there is no "
                 "post or no triangle");
}

Result<void> check(const RasterOutput& output) {
  for (const std::string& path : {output.heights, output.errors})
    if (!path.empty())
      if (const auto format = raster_format(path); !format) return std::unexpected(format.error());
  return {};
}

Result<void> check(const RasterOutput& output, const DemInfo& info) {
  for (const std::string& path : {output.heights, output.errors}) {
    if (path.empty()) continue;
    if (auto ok = can_say(*raster_format(path), info); !ok) return ok;
    if (auto ok = can_lie_there(path, info); !ok) return ok;
  }
  return {};
}

int write_rasters(const RasterOutput& output, const DemInfo& info, const Tin& mesh,
                  const RasterRows& posts, int threads) {
  if (!output.heights.empty())
    if (const int code = write_one(output.heights, true, info, mesh, posts, threads); code != kOk)
      return code;
  if (output.errors.empty()) return kOk;
  return write_one(output.errors, false, info, mesh, posts, threads);
}

}  // namespace tind::cli
