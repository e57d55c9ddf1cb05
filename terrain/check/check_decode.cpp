// Written from the specification's text, byte by byte (no casts, no memcpy of structures).
//
// Where the counts do not fit the bytes, the tile is read again as if its maker had forgotten the
// padding or taken the other index width: if it fits then, that is what is reported.

#include "terrain/check/check_decode.h"

#include <bit>
#include <cmath>
#include <optional>

namespace tind {

namespace {

using Bytes = std::span<const std::uint8_t>;

std::uint64_t unsigned_at(Bytes bytes, std::size_t at, int size) {
  std::uint64_t value = 0;
  for (int i = size - 1; i >= 0; --i) value = value << 8 | bytes[at + std::size_t(i)];
  return value;
}

double double_at(Bytes bytes, std::size_t at) {
  return std::bit_cast<double>(unsigned_at(bytes, at, 8));
}

double float_at(Bytes bytes, std::size_t at) {
  return double(std::bit_cast<float>(std::uint32_t(unsigned_at(bytes, at, 4))));
}

/// How a maker may have laid out what follows the vertices.
struct Layout {
  int index_size = 2;
  std::size_t padding = 0;
};

Layout specified(std::size_t vertices) {
  if (vertices <= 65536) return {2, 0};
  return {4, vertices % 2 == 0 ? 0u : 2u};
}

/// Triangles and edges read with one layout; nothing when they do not fit.
struct Indices {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::array<std::vector<std::uint32_t>, 4> edges;
  std::size_t end = 0;
  bool valid = true;  // every high-water-mark code names a vertex
};

std::optional<Indices> read_indices(Bytes bytes, std::size_t vertices, Layout layout) {
  Indices out;
  const auto size = std::size_t(layout.index_size);
  std::size_t at = 92 + 6 * vertices + layout.padding;
  if (at + 4 > bytes.size()) return std::nullopt;
  const std::uint64_t count = unsigned_at(bytes, at, 4);
  at += 4;
  if (count > (bytes.size() - at) / (3 * size)) return std::nullopt;
  std::uint64_t next = 0;  // the vertex that a code of zero names
  for (std::uint64_t t = 0; t < count; ++t) {
    std::array<std::uint32_t, 3> triangle{};
    for (std::uint32_t& corner : triangle) {
      const std::uint64_t code = unsigned_at(bytes, at, layout.index_size);
      at += size;
      out.valid &= code <= next && next - code < vertices;
      corner = std::uint32_t(code <= next ? next - code : 0);
      if (code == 0) ++next;
    }
    out.triangles.push_back(triangle);
  }
  for (auto& edge : out.edges) {
    if (at + 4 > bytes.size()) return std::nullopt;
    const std::uint64_t length = unsigned_at(bytes, at, 4);
    at += 4;
    if (length > (bytes.size() - at) / size) return std::nullopt;
    for (std::uint64_t i = 0; i < length; ++i, at += size)
      edge.push_back(std::uint32_t(unsigned_at(bytes, at, layout.index_size)));
  }
  out.end = at;
  return out;
}

class Reader {
 public:
  Reader(Bytes bytes, const std::string& where, CheckedTile& tile, Findings& findings)
      : bytes_(bytes), where_(where), tile_(tile), findings_(findings) {}

  bool read() {
    if (bytes_.size() < 92) {
      report(rule("tile.truncated"), std::to_string(bytes_.size()) + " bytes are no header");
      return false;
    }
    header();
    if (!vertices()) return false;
    if (!indices()) return false;
    extensions();
    return true;
  }

 private:
  void report(std::size_t r, const std::string& detail) { findings_.add(r, where_, detail); }

  void header() {
    for (std::size_t i = 0; i < 3; ++i) tile_.center[i] = double_at(bytes_, 8 * i);
    tile_.min_height = float_at(bytes_, 24);
    tile_.max_height = float_at(bytes_, 28);
    for (std::size_t i = 0; i < 4; ++i) tile_.sphere[i] = double_at(bytes_, 32 + 8 * i);
    for (std::size_t i = 0; i < 3; ++i) tile_.horizon[i] = double_at(bytes_, 64 + 8 * i);
    bool finite = std::isfinite(tile_.min_height) && std::isfinite(tile_.max_height);
    for (const double x : tile_.center) finite &= std::isfinite(x);
    for (const double x : tile_.sphere) finite &= std::isfinite(x);
    for (const double x : tile_.horizon) finite &= std::isfinite(x);
    if (!finite) report(rule("tile.header"), "a number of the header is not finite");
  }

  bool vertices() {
    count_ = unsigned_at(bytes_, 88, 4);
    if (count_ > (bytes_.size() - 92) / 6) {
      report(rule("tile.truncated"), std::to_string(count_) + " vertices are not there");
      return false;
    }
    bool inside = true;
    std::size_t at = 92;
    for (auto* values : {&tile_.u, &tile_.v, &tile_.h}) {
      values->reserve(count_);
      std::int64_t value = 0;
      for (std::size_t i = 0; i < count_; ++i, at += 2) {
        const auto code = std::int64_t(unsigned_at(bytes_, at, 2));
        value += code % 2 == 0 ? code / 2 : -(code + 1) / 2;
        inside &= value >= 0 && value <= 32767;
        values->push_back(std::int32_t(value));
      }
    }
    if (!inside) report(rule("tile.quantised"), "a coordinate is outside 0..32767");
    return inside;
  }

  bool indices() {
    const Layout right = specified(count_);
    auto found = read_indices(bytes_, count_, right);
    if (!found || !found->valid) {
      for (const Layout other :
           {Layout{right.index_size, 2 - right.padding}, Layout{6 - right.index_size, 0},
            Layout{6 - right.index_size, 2}}) {
        auto twin = read_indices(bytes_, count_, other);
        if (!twin || !twin->valid || twin->triangles.empty()) continue;
        const bool width = other.index_size != right.index_size;
        report(width ? rule("tile.index-width") : rule("tile.padding"),
               std::to_string(count_) + " vertices with " + std::to_string(8 * other.index_size) +
                   "-bit indices, " + std::to_string(other.padding) + " bytes of padding");
        found = std::move(twin);
        break;
      }
    }
    if (!found) {
      report(rule("tile.truncated"), "triangles or edges do not fit into the tile");
      return false;
    }
    if (!found->valid) report(rule("tile.index"), "a triangle names a vertex that is not there");
    at_ = found->end;
    tile_.triangles = std::move(found->triangles);
    tile_.edges = std::move(found->edges);
    return found->valid;
  }

  void extensions() {
    std::array<int, 256> seen{};
    bool swapped = false;
    while (at_ < bytes_.size()) {
      if (bytes_.size() - at_ < 5) {
        report(rule("tile.trailing"), std::to_string(bytes_.size() - at_) + " bytes at the end");
        return;
      }
      const std::uint8_t id = bytes_[at_];
      std::uint64_t length = unsigned_at(bytes_, at_ + 1, 4);
      const std::uint64_t other = std::uint64_t(bytes_[at_ + 1]) << 24 | bytes_[at_ + 2] << 16 |
                                  bytes_[at_ + 3] << 8 | bytes_[at_ + 4];
      at_ += 5;
      if (length > bytes_.size() - at_ && other <= bytes_.size() - at_) {
        if (!swapped) report(rule("ext.big-endian"), "extension " + std::to_string(id));
        swapped = true;
      }
      if (swapped) length = other;
      if (length > bytes_.size() - at_) {
        report(rule("tile.truncated"), "extension " + std::to_string(id) + " is not there");
        return;
      }
      if (seen[id]++ == 1) report(rule("ext.duplicate"), "extension " + std::to_string(id));
      extension(id, bytes_.subspan(at_, std::size_t(length)));
      at_ += std::size_t(length);
    }
  }

  void extension(int id, Bytes body) {
    if (id == 1)
      normals(body);
    else if (id == 2)
      water_mask(body);
    else if (id == 4)
      metadata(body);
    else
      report(rule("ext.unknown"), "extension " + std::to_string(id));
  }

  void normals(Bytes body) {
    if (body.size() != 2 * count_)
      return report(rule("ext.normals"), std::to_string(body.size()) + " bytes for " +
                                             std::to_string(count_) + " vertices");
    tile_.normals.clear();
    for (std::size_t i = 0; i < count_; ++i)
      tile_.normals.push_back({body[2 * i], body[2 * i + 1]});
  }

  void water_mask(Bytes body) {
    tile_.has_water_mask = true;
    if (body.size() != 1 && body.size() != 256 * 256)
      report(rule("ext.water-mask"), std::to_string(body.size()) + " bytes");
    else
      tile_.water_mask.assign(body.begin(), body.end());
  }

  void metadata(Bytes body) {
    const std::uint64_t length = body.size() < 4 ? 0 : unsigned_at(body, 0, 4);
    if (body.size() < 4 || length != body.size() - 4)
      return report(rule("ext.metadata"), "the JSON's length is not the extension's less 4");
    tile_.metadata.assign(body.begin() + 4, body.end());
  }

  Bytes bytes_;
  const std::string& where_;
  CheckedTile& tile_;
  Findings& findings_;
  std::size_t count_ = 0, at_ = 0;
};

}  // namespace

bool check_decode(std::span<const std::uint8_t> bytes, const std::string& where, CheckedTile& tile,
                  Findings& findings) {
  return Reader(bytes, where, tile, findings).read();
}

}  // namespace tind
