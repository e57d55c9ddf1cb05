#include "terrain/store/open/open_store.h"

#include <filesystem>
#include <string_view>
#include <utility>

#include "terrain/raster/dem_files.h"
#include "terrain/store/folder/folder_store.h"
#include "terrain/store/folder/folder_writer.h"
#include "terrain/store/mbtiles/mbtiles_store.h"
#include "terrain/store/mbtiles/mbtiles_writer.h"
#include "terrain/store/pmtiles/pmtiles_store.h"
#include "terrain/store/pmtiles/pmtiles_writer.h"
#include "terrain/store/url/url_store.h"

namespace tind {

namespace {

/// How a kind of archive is read and written, by the ending of its name.
struct ArchiveKind {
  std::string_view ending;
  std::unique_ptr<TileStore> (*open)(const std::string&);
  Result<std::unique_ptr<ArchiveWriter>> (*write)(const std::string&, ArchiveHead);
};
constexpr ArchiveKind kArchives[] = {{".pmtiles", pmtiles_store, write_pmtiles},
                                     {".mbtiles", mbtiles_store, write_mbtiles}};

const ArchiveKind* archive_of(const std::string& location) {
  if (is_url(location)) return nullptr;
  for (const ArchiveKind& kind : kArchives)
    if (location.ends_with(kind.ending)) return &kind;
  return nullptr;
}

}  // namespace

bool names_archive(const std::string& location) {
  std::error_code none;
  return archive_of(location) && !std::filesystem::is_directory(location, none);
}

bool names_store(const std::string& location) {
  std::error_code none;
  return is_url(location) || names_archive(location) || location.ends_with("layer.json") ||
         (std::filesystem::is_directory(location, none) && !is_dem_folder(location));
}

std::unique_ptr<TileStore> open_store(const std::string& location) {
  if (is_url(location)) return url_store(location, gdal_url_reader());
  if (names_archive(location)) return archive_of(location)->open(location);
  return folder_store(location);
}

Result<std::unique_ptr<LockedStore>> lock_store(const std::string& location) {
  if (names_archive(location))
    return fail(Errc::invalid_argument,
                location + " is no directory: build in one, and tind copy makes the archive of it");
  return lock_folder(location);
}

Result<std::unique_ptr<ArchiveWriter>> write_archive_store(const std::string& file,
                                                           ArchiveHead head) {
  if (!names_archive(file))
    return fail(Errc::invalid_argument, file + " is no name of an archive of tiles");
  return archive_of(file)->write(file, std::move(head));
}

Result<std::string> read_kept_blocks(const std::string& location, const BuildRecord& record) {
  if (is_url(location)) return fail(Errc::not_found, location + " keeps no hashes of blocks");
  if (names_archive(location)) return open_store(location)->kept_blocks();
  return kept_blocks(location, record);
}

Result<std::vector<std::uint8_t>> read_one_tile(const std::string& location) {
  return is_url(location) ? fetch_tile(gdal_url_reader(), location) : read_stored_file(location);
}

}  // namespace tind
