#pragma once
// Which rasters a DEM is made of, where a folder or a list was named instead of each.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind {

struct DemFiles {
  std::vector<std::string> files;
  std::vector<std::string> warnings;  // what was left out, one line each
};

/// Names of files stay as they are. A folder stands for the rasters in it, by their names' endings
/// (.tif, .hgt, .img ...; of pictures, .png, only where it has no other), sorted, not those of
/// folders in it; what else lies there is left out and counted in a warning, except for what
/// belongs to a raster (.hdr, .prj, .tfw ...). "@list.txt" stands for the files and folders that it
/// names, one a line, blank lines and those after '#' aside; a relative name is looked for in the
/// current folder, then beside the list. Errors (not_found, bad_data) say what was looked for. A
/// folder that holds a layer.json has tiles, and is an error.
Result<DemFiles> dem_files(std::span<const std::string> named, const DemOptions&);

/// Whether a path is a folder that holds rasters and no layer.json: a DEM rather than tiles.
bool is_dem_folder(const std::string& path);

/// Absolute paths of all files that a VRT is read from, the parts of its parts among them; empty
/// for anything else. Opens it and its parts, and reads no block: only where --allow-vrt was said.
std::vector<std::string> files_of_vrt(const std::string& path);

/// Whether it names a GeoTIFF on another machine: s3://, https:// or, on this machine, http://,
/// ending in .tif or .tiff.
bool is_remote_dem(const std::string& name);

/// Whether the name ends as one of a raster does, in letters of either case; .vrt only where it is
/// allowed.
bool has_raster_ending(const std::string& name, bool allow_vrt);

/// Whether the name ends as those of raw numbers do, which are what a header beside them says, so
/// that any file passes for one.
bool is_raw_raster(std::string_view name);

/// Files that are not read as long as they are not there, and make other heights of a raster of
/// this name, or put them elsewhere, once they are: its mask; the CRS and the place of what has
/// none inside. None of what is in an archive or on another machine.
std::vector<std::string> may_come_beside(const std::string& raster);

}  // namespace tind
