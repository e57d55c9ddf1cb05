#pragma once
// Where stored tiles are: a directory or a base URL. Bytes by name, no opinion of what is in them.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/tiling_scheme.h"

namespace tind {

class TileLocation {
 public:
  /// DIR, DIR/layer.json, http(s)://.../NAME or .../NAME/layer.json.
  explicit TileLocation(const std::string& text);

  bool remote() const { return remote_; }
  const std::string& base() const { return base_; }  // without a slash at the end

  /// The template of layer.json by which a server's tiles are found; directories always
  /// hold z/x/y.terrain.
  void use_template(const std::string& text, const std::string& version);
  /// Path or URL.
  std::string tile(TileId) const;
  std::string file(const std::string& name) const { return base_ + "/" + name; }

  /// The bytes behind tile() or file(), as they are stored; 64 MiB at most. not_found, or io.
  Result<std::vector<std::uint8_t>> read(const std::string& path) const;

 private:
  std::string base_, template_;
  bool remote_ = false;
};

/// z/x/y.terrain as a tile of the pyramid.
std::optional<TileId> tile_of_path(const std::filesystem::path& relative);

/// Unpacks gzip data in place; what is not gzip stays. False when the data are damaged.
bool gunzip(std::vector<std::uint8_t>& bytes);

}  // namespace tind
