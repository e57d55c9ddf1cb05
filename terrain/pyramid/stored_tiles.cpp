// A directory of tiles as a tile set: layer.json and z/x/y.terrain, plain or gzipped.

#include <libdeflate.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "proto/quantized_mesh.h"
#include "terrain/pyramid/tileset.h"

namespace tind {

namespace {

constexpr std::size_t kLargestTile = 64u << 20;

Result<std::vector<std::uint8_t>> read_file(const std::string& path) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error) {
    const bool missing = error == std::errc::no_such_file_or_directory;
    return fail(missing ? Errc::not_found : Errc::io, path + ": " + error.message());
  }
  if (size > kLargestTile) return fail(Errc::bad_data, path + " is too large for a tile");
  std::vector<std::uint8_t> bytes(size);
  std::ifstream in(path, std::ios::binary);
  if (!in.read(reinterpret_cast<char*>(bytes.data()), std::streamsize(size)))
    return fail(Errc::io, "cannot read " + path);
  return bytes;
}

bool is_gzip(const std::vector<std::uint8_t>& b) {
  return b.size() > 18 && b[0] == 0x1f && b[1] == 0x8b;
}

Result<std::vector<std::uint8_t>> gunzip(const std::vector<std::uint8_t>& in,
                                         const std::string& path) {
  // The last four bytes hold the size, which a damaged file can lie about: bounded.
  const std::size_t n = in.size();
  const std::size_t size =
      in[n - 4] | in[n - 3] << 8 | in[n - 2] << 16 | std::size_t(in[n - 1]) << 24;
  if (size > kLargestTile) return fail(Errc::bad_data, path + ": damaged gzip data");
  std::vector<std::uint8_t> out(size);
  libdeflate_decompressor* d = libdeflate_alloc_decompressor();
  const auto result = libdeflate_gzip_decompress(d, in.data(), n, out.data(), size, nullptr);
  libdeflate_free_decompressor(d);
  if (result != LIBDEFLATE_SUCCESS) return fail(Errc::bad_data, path + ": damaged gzip data");
  return out;
}

class StoredTiles : public TileSet {
 public:
  StoredTiles(std::string directory, proto::LayerJson layer)
      : directory_(std::move(directory)), layer_(std::move(layer)) {}

  const proto::LayerJson& layer() const override { return layer_; }
  bool available(TileId id) const override { return layer_.contains(id.level, id.x, id.y); }

  Result<TileBytes> tile(TileId id, std::stop_token) const override {
    if (!available(id)) return fail(Errc::not_found, "no tile " + id.text() + " in this dataset");
    const std::string path = directory_ + "/" + id.text() + ".terrain";
    auto bytes = read_file(path);
    if (bytes && is_gzip(*bytes)) bytes = gunzip(*bytes, path);
    if (!bytes) {
      // It is listed as available: that it is not there is the store's fault, not the client's.
      if (bytes.error().code == Errc::not_found) return fail(Errc::io, bytes.error().what);
      return std::unexpected(bytes.error());
    }
    std::string reason;
    const auto mesh = proto::decode(*bytes, reason);
    if (!mesh) return fail(Errc::bad_data, path + ": " + reason);
    TileBytes tile;
    tile.bytes = std::move(*bytes);
    const auto metadata = nlohmann::json::parse(mesh->metadata, nullptr, false);
    if (metadata.is_object() && metadata.contains("max_error_m") &&
        metadata["max_error_m"].is_number()) {
      tile.max_error_m = metadata["max_error_m"];
      tile.exact = metadata.value("error_kind", "") == "exact";
    }
    return tile;
  }
  const DemSource* dem() const override { return nullptr; }

 private:
  std::string directory_;
  proto::LayerJson layer_;
};

}  // namespace

Result<std::unique_ptr<TileSet>> open_stored_tiles(const std::string& directory) {
  const std::string path = directory + "/layer.json";
  const auto bytes = read_file(path);
  if (!bytes) {
    return fail(bytes.error().code, path +
                                        " cannot be read: is this a directory made by tind build "
                                        "that was finished?");
  }
  std::string reason;
  auto layer = proto::decode_layer_json(
      {reinterpret_cast<const char*>(bytes->data()), bytes->size()}, reason);
  if (!layer) return fail(Errc::bad_data, path + ": " + reason);
  return std::make_unique<StoredTiles>(directory, std::move(*layer));
}

}  // namespace tind
