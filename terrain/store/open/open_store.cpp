#include "terrain/store/open/open_store.h"

#include <filesystem>

#include "terrain/raster/dem_files.h"
#include "terrain/store/folder/folder_store.h"
#include "terrain/store/folder/folder_writer.h"
#include "terrain/store/url/url_store.h"

namespace tind {

bool names_store(const std::string& location) {
  std::error_code none;
  return is_url(location) || location.ends_with("layer.json") ||
         (std::filesystem::is_directory(location, none) && !is_dem_folder(location));
}

std::unique_ptr<TileStore> open_store(const std::string& location) {
  if (is_url(location)) return url_store(location, gdal_url_reader());
  return folder_store(location);
}

Result<std::unique_ptr<LockedStore>> lock_store(const std::string& location) {
  return lock_folder(location);
}

Result<std::string> read_kept_blocks(const std::string& location, const BuildRecord& record) {
  if (is_url(location)) return fail(Errc::not_found, location + " keeps no hashes of blocks");
  return kept_blocks(location, record);
}

Result<std::vector<std::uint8_t>> read_one_tile(const std::string& location) {
  return is_url(location) ? fetch_tile(gdal_url_reader(), location) : read_stored_file(location);
}

}  // namespace tind
