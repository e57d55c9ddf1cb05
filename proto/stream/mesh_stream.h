#pragma once
// .tpm: a progressive mesh as a stream of bytes, coarse to fine. docs/formats.md describes every
// byte. Any prefix that reaches beyond the base is a valid mesh with a known error.
//
// Positions are whole numbers on a lattice. Version 1 is terrain: x = X / per_post columns,
// y = Y / per_post (minus the row), z = Z * z_step metres, every triangle counter-clockwise seen
// from above. Version 2 is any surface in space: each coordinate is (origin + X) / per_unit, and
// nothing is asked of a triangle's direction.
//
// Splits come in blocks; `error_m` of a block bounds the error of every state from its first split
// on until the next block begins: vertical, metres, or for a surface in space the distance between
// it and the finest one, in the mesh's own unit. Within a block, splits that do not touch each
// other are sorted by vertex, which is what makes them small.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind::proto {

using LatticePoint = std::array<std::int32_t, 3>;

struct LatticeSplit {
  static constexpr std::uint32_t kNone = ~std::uint32_t(0);

  std::uint32_t vertex = 0, left = 0, right = kNone;  // as in terrain/progressive
  LatticePoint fine{}, added{};                       // where vertex goes; where the new one lies
  friend bool operator==(const LatticeSplit&, const LatticeSplit&) = default;
};

struct StreamBlock {
  std::uint32_t splits = 0;
  float error_m = 0;
  friend bool operator==(const StreamBlock&, const StreamBlock&) = default;
};

/// Its number is the version of the bytes.
enum class StreamFrame : std::uint16_t { terrain = 1, space = 2 };

struct MeshStream {
  StreamFrame frame = StreamFrame::terrain;
  double fine_error_m = 0;  // after the last split
  // terrain
  std::uint16_t per_post = 1;
  double z_step_m = 1;
  std::uint32_t cols = 0, rows = 0;     // of the DEM
  std::array<double, 6> post_to_crs{};  // x = a0 + a1 col + a2 row, y = a3 + a4 col + a5 row
  double z_unit_m = 1;                  // metres per unit of the source's heights
  std::uint8_t datum = 0;               // 0 unknown, 1 ellipsoid, 2 EGM96
  // space
  double per_unit = 1;
  std::array<double, 3> origin{};  // whole numbers
  // both
  std::string crs;  // name, a line feed, WKT 2; empty without a CRS
  std::vector<LatticePoint> base_vertices;
  std::vector<std::array<std::uint32_t, 3>> base_triangles;
  std::uint32_t total_splits = 0;  // of the whole stream
  std::vector<StreamBlock> blocks;
  std::vector<LatticeSplit> splits;  // as many as there are; total_splits when complete
  // Of a stream that was decoded: how many of its bytes it takes to know each block's head, and
  // each split; `base_bytes` to know the base.
  std::size_t base_bytes = 0;
  std::vector<std::uint32_t> block_bytes, split_bytes;
};

/// Of X, Y and Z in space, either way; on terrain X and Y reach to 2^29, Z to 2^30.
inline constexpr std::int32_t kMostInSpace = 1 << 28;

/// REQUIRES of the splits: that they can be applied one after the other, and coordinates of the
/// sizes above. Else bad_data.
Result<std::vector<std::uint8_t>> encode(const MeshStream&);

/// Any prefix of a stream: as many splits as its bytes say for certain. bad_data, and nothing else,
/// for bytes that are no such prefix (`bytes too few for the base` included), and for a split that
/// would flip a triangle of a terrain, or makes more than two splits a byte (beyond the first
/// thousand). Never reads outside; allocates at most 500 times their size, and 1 MB.
Result<MeshStream> decode_mesh_stream(std::span<const std::uint8_t> bytes);

/// Where a reader may stop: at the first state that is known to be within max_error_m, and at the
/// last one of at most `triangles`.
struct StreamLimit {
  double max_error_m = 0;
  std::size_t triangles = ~std::size_t(0);
};

/// How many of the bytes lead to the coarser of the two, its error included; all of them where
/// neither comes, those of the base at least. REQUIRES: a stream that was decoded as a whole.
std::size_t bytes_until(const MeshStream&, const StreamLimit&);

}  // namespace tind::proto
