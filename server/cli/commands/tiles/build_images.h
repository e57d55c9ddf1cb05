#pragma once
// tind build --format of images: tiles of web maps in a directory.

#include <cstdint>
#include <optional>
#include <string>

#include "server/cli/program/command_line.h"
#include "terrain/base/enum_names.h"
#include "terrain/base/progress.h"
#include "terrain/images/image_folder.h"
#include "terrain/pyramid/plan/tile_set_options.h"

namespace tind::cli {

/// "rgb", "terrarium", "hillshade", "slope", "aspect"; nothing for other formats.
std::optional<ImageContent> image_format(const std::string& format);

/// Which surface images of heights show: the DEM, or the certified mesh of its tiles.
enum class ImagedSurface { source, mesh };

}  // namespace tind::cli

template <>
struct tind::EnumNames<tind::cli::ImagedSurface> {
  static constexpr const char* kWhat = "surface";
  static constexpr std::pair<cli::ImagedSurface, const char*> kAll[] = {
      {cli::ImagedSurface::source, "source"}, {cli::ImagedSurface::mesh, "mesh"}};
};

namespace tind::cli {

/// Fails (invalid_argument) where the line has an option that means nothing for these images, and
/// names it.
Result<void> check_image_options(Command, const std::string& format, ImagedSurface);

/// What they are made of; of meshes tiles as `options` have them, of all levels. Fails as
/// open_dem_tiles().
Result<ImageSource> image_source(const Surface&, const ImageKind&, ImagedSurface,
                                 const TileSetOptions& options);

/// Makes them and prints the report; the exit code. `name`: for people, in tiles.json.
int build_images(const ImageSource&, const VerticalDatum&, const std::string& name,
                 const ImageFolderOptions&, bool json, const Progress&);

}  // namespace tind::cli
