#pragma once
// What a process that decodes is told, and what it says of a file, as bytes.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/gdal/heights/height_file.h"

namespace tind::gdal {

/// What a crew of processes is for.
struct Brief {
  std::uint32_t parent = 0;  // the process that it works for
  std::vector<std::string> files;
  DemOptions options;  // as far as they are of files
};
std::string brief_text(std::span<const std::string> files, const DemOptions&);
Result<Brief> read_brief(std::string_view);

/// What became known when a file was opened.
struct OpenedFile {
  FileFacts facts;
  std::vector<FileStates::Entry> states;
  std::string same;  // equal whenever the same files are opened; a CRS has several wordings
};
std::string opened_text(const HeightFile&);
/// Errc::bad_data for anything that RasterFile would not have said of `path`: a number that cannot
/// be, a name that no driver has, a file that does not belong to it.
Result<OpenedFile> read_opened(std::string_view, const std::string& path, const DemOptions&);

/// Whether a driver may ask for `other` because of `raster`: the same name but for its ending.
bool belongs_to(const std::string& raster, const std::string& other);
/// The rasters, and what belongs to each where there is any. Fails where a folder cannot be looked
/// into: a mask that is not seen would be ignored.
Result<std::vector<std::string>> files_of_rasters(std::span<const std::string> rasters);

}  // namespace tind::gdal
