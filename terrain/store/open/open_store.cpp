#include "terrain/store/open/open_store.h"

#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <utility>

#include "terrain/base/lower_case.h"
#include "terrain/raster/dem_files.h"
#include "terrain/raster/remote/objects.h"
#include "terrain/store/folder/folder_store.h"
#include "terrain/store/folder/folder_writer.h"
#include "terrain/store/mbtiles/mbtiles_store.h"
#include "terrain/store/mbtiles/mbtiles_writer.h"
#include "terrain/store/object/object_archive.h"
#include "terrain/store/object/object_store.h"
#include "terrain/store/object/object_writer.h"
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
  bool by_ranges;  // can be read where it is on another machine
};
constexpr ArchiveKind kArchives[] = {{".pmtiles", pmtiles_store, write_pmtiles, true},
                                     {".mbtiles", mbtiles_store, write_mbtiles, false}};

const ArchiveKind* archive_of(const std::string& location) {
  for (const ArchiveKind& kind : kArchives)
    if (lower_case(location).ends_with(kind.ending) &&
        (kind.by_ranges || !remote::is_remote(location)))
      return &kind;
  return nullptr;
}

std::unexpected<Error> not_written(const std::string& url) {
  return fail(Errc::invalid_argument, url + ": a web server is only read; write to s3://");
}

}  // namespace

bool names_archive(const std::string& location) {
  std::error_code none;
  return archive_of(location) &&
         (remote::is_remote(location) || !std::filesystem::is_directory(location, none));
}

bool names_store(const std::string& location) {
  std::error_code none;
  if (remote::is_remote(location)) return !is_remote_dem(location);
  return names_archive(location) || location.ends_with("layer.json") ||
         (std::filesystem::is_directory(location, none) && !is_dem_folder(location));
}

/// For daemons that take keys. Read here and now: nothing else is to hold it.
std::string key_of_environment() {
  const char* const key = std::getenv("TIND_KEY");
  return key ? key : "";
}

Error no_store(const std::string& location) {
  std::error_code none;
  if (!remote::is_remote(location) && !std::filesystem::exists(location, none))
    return {Errc::not_found, location + ": there is no such file or folder"};
  return {Errc::invalid_argument, location +
                                      " is no tile set: name a directory of tiles, "
                                      "X.pmtiles, X.mbtiles, s3://BUCKET/PREFIX or a URL"};
}

std::unique_ptr<TileStore> open_store(const std::string& location) {
  if (names_archive(location)) return archive_of(location)->open(location);
  if (remote::is_s3(location)) return object_store(location, remote::Objects::of_environment());
  if (is_url(location)) return url_store(location, gdal_url_reader(), key_of_environment());
  return folder_store(location);
}

Result<std::unique_ptr<LockedStore>> lock_store(const std::string& location) {
  if (names_archive(location))
    return fail(Errc::invalid_argument,
                location + " is no directory: build in one, and tind copy makes the archive of it");
  if (remote::is_s3(location)) return lock_objects(location, remote::Objects::of_environment());
  if (is_url(location)) return not_written(location);
  return lock_folder(location);
}

Result<std::unique_ptr<ArchiveWriter>> write_archive_store(const std::string& file,
                                                           ArchiveHead head) {
  if (!names_archive(file))
    return fail(Errc::invalid_argument, file + " is no name of an archive of tiles");
  const ArchiveKind& kind = *archive_of(file);
  if (is_url(file)) return not_written(file);
  if (!remote::is_s3(file)) {
    std::error_code none;  // where it cannot be made, the file cannot, and says so
    std::filesystem::create_directories(std::filesystem::path(file).parent_path(), none);
    return kind.write(file, std::move(head));
  }
  return write_object_archive(file, "tiles" + std::string(kind.ending),
                              remote::Objects::of_environment(),
                              [&](const std::string& path) { return kind.write(path, head); });
}

Result<std::string> read_kept_blocks(const std::string& location, const BuildRecord& record) {
  if (remote::is_remote(location) || names_archive(location))
    return open_store(location)->kept_blocks();
  return kept_blocks(location, record);
}

Result<std::vector<std::uint8_t>> read_one_tile(const std::string& location) {
  if (!remote::is_s3(location))
    return is_url(location) ? fetch_tile(gdal_url_reader(), location, key_of_environment())
                            : read_stored_file(location);
  auto got = remote::Objects::of_environment().get(location, kLargestStored);
  if (!got) return std::unexpected(got.error());
  return std::move(got->bytes);
}

}  // namespace tind
