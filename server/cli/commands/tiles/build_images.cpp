#include "server/cli/commands/tiles/build_images.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>
#include <variant>

#include "proto/json_text.h"
#include "server/cli/program/exit.h"
#include "server/cli/program/peak_memory.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/geo/web_mercator.h"
#include "terrain/pyramid/make/dem_tiles.h"
#include "terrain/surface/on_globe.h"

namespace tind::cli {
namespace {

constexpr const char* kOnlyFolders[] = {"--gzip", "--dry-run"};
constexpr const char* kOnlyMeshes[] = {
    "--max-error", "--error-factor", "--deepest",    "--side",  "--exact-posts",
    "--effort",    "--method",       "--breaklines", "--water", "--layer-error"};

nlohmann::ordered_json to_json(const ImageFolderReport& r, const VerticalDatum& datum,
                               double seconds) {
  return {{"vertical_datum", name(datum)},
          {"tiles", r.tiles},
          {"built", r.built},
          {"reused", r.reused},
          {"bytes", r.bytes},
          {"seconds", seconds},
          {"peak_mb", PeakMemory::megabytes()}};
}

}  // namespace

std::optional<ImageContent> image_format(const std::string& format) {
  if (format == "rgb") return proto::HeightCode::mapbox;
  if (format == "terrarium") return proto::HeightCode::terrarium;
  if (const auto style = shade_style_named(format)) return Shade{.style = *style};
  return {};
}

Result<void> check_image_options(Command command, const std::string& format, ImagedSurface imaged) {
  for (const char* option : kOnlyFolders)
    if (command.given(option))
      return fail(
          Errc::invalid_argument,
          fmt::format("{} is of tiles of meshes: leave it out with --format {}", option, format));
  if (imaged == ImagedSurface::mesh) {
    if (format == "rgb" || format == "terrarium") return {};
    return fail(
        Errc::invalid_argument,
        fmt::format("--surface mesh is of heights: --format rgb or terrarium, not {}", format));
  }
  for (const char* option : kOnlyMeshes)
    if (command.given(option))
      return fail(Errc::invalid_argument,
                  fmt::format("{} is of meshes: leave it out with --format {}, or add --surface "
                              "mesh",
                              option, format));
  return {};
}

Result<ImageSource> image_source(const Surface& surface, const ImageKind& kind,
                                 ImagedSurface imaged, const TileSetOptions& options) {
  if (const auto ok = check_on_globe(surface.info()); !ok) return std::unexpected(ok.error());
  const auto* const code = std::get_if<proto::HeightCode>(&kind.content);
  if (imaged == ImagedSurface::source || !code) return images_of(surface, kind);
  TileSetOptions all = options;  // --levels are of images here
  all.first_level = 0, all.last_level = TileSetOptions().last_level;
  auto tiles = open_dem_tiles(surface, all, std::numeric_limits<std::int64_t>::max());
  if (!tiles) return std::unexpected(tiles.error());
  return images_of(std::shared_ptr<const TileSet>(std::move(*tiles)), *code, kind.format);
}

int build_images(const ImageSource& source, const VerticalDatum& datum, const std::string& name,
                 const ImageFolderOptions& options, bool json, const Progress& progress) {
  const int deepest = source.description.maxzoom;
  if (options.first_level > deepest)
    return complain({Errc::invalid_argument,
                     fmt::format("--levels begins with {}: the deepest level of images of this "
                                 "source is {}",
                                 options.first_level, deepest)});
  const auto begin = std::chrono::steady_clock::now();
  const auto report = write_images(source, name, options, progress);
  if (!report) return complain(report.error());
  if (*source.beyond_m > 0)
    warn(
        fmt::format("heights lie up to {:.6g} m beyond what these colours can say (terrain-RGB: "
                    "-9999.9 m and up), and stand at its end: --format terrarium reaches from "
                    "-32768 to 32767 m",
                    source.beyond_m->load()));
  if (!source.has({0, 0, 0}))
    warn(
        fmt::format("there is no image: all of the DEM lies beyond {:.2f} degrees of latitude, "
                    "where web maps end; tiles of meshes (without --format) reach to the poles",
                    web_mercator::rect({0, 0, 0}).north));
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (json)
    fmt::print("{}\n", json::to_text(to_json(*report, datum, seconds), 1));
  else
    fmt::print("{} images ({} built, {} kept), {} bytes, in {}; vertical datum: {}\n",
               report->tiles, report->built, report->reused, report->bytes, duration_text(seconds),
               tind::name(datum));
  return kOk;
}

}  // namespace tind::cli
