#pragma once
// The files of anyone's 3D Tiles, in a folder or in a .3tz.

#include <cstdint>
#include <istream>
#include <map>
#include <memory>
#include <string>

#include "terrain/base/result.h"

namespace tind {

/// Does the text name 3D Tiles: a folder with a tileset.json and without a layer.json, that
/// tileset.json, or a .3tz?
bool names_tileset(const std::string& location);

class TilesetFiles {
 public:
  /// not_found, or bad_data: no zip archive.
  static Result<std::unique_ptr<TilesetFiles>> open(const std::string& location);
  /// The same of an archive of so many bytes, wherever it lies; `name` is for messages.
  static Result<std::unique_ptr<TilesetFiles>> of_archive(std::unique_ptr<std::istream>,
                                                          std::uint64_t bytes,
                                                          const std::string& name);
  virtual ~TilesetFiles() = default;

  /// Of one file, as it lies there and unpacked: so much memory a read takes, however large
  /// somebody's archive says that it is.
  static constexpr std::uint64_t kMostBytes = 256u << 20;

  /// By their names, relative and with '/': how many bytes each takes where it lies.
  const std::map<std::string, std::uint64_t>& sizes() const { return sizes_; }
  /// Of all: the folder's tileset.json, .glb and .subtree, or the archive.
  std::uint64_t bytes() const { return bytes_; }
  bool archive() const { return archive_; }

  /// Unpacked. not_found; io; bad_data: other bytes than the archive's checksum is of;
  /// out_of_range: more than kMostBytes.
  virtual Result<std::string> read(const std::string& name) const = 0;
  /// What is wrong with the index by which clients find an archive's files; empty: nothing.
  virtual Result<std::string> wrong_index() const { return std::string(); }

 protected:
  std::map<std::string, std::uint64_t> sizes_;
  std::uint64_t bytes_ = 0;
  bool archive_ = false;
};

}  // namespace tind
