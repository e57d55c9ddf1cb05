#pragma once
// The checker's own reader of quantized-mesh. It shares nothing with proto/tile/quantized_mesh.cpp,
// so that a misunderstanding there shows here; and it reads on past a fault where that makes sense,
// so that one broken rule does not hide the next.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrain/check/check_findings.h"

namespace tind {

/// A tile as decoded; everything is wide enough to hold what is wrong, too.
struct CheckedTile {
  std::array<double, 3> center{};
  double min_height = 0, max_height = 0;
  std::array<double, 4> sphere{};
  std::array<double, 3> horizon{};
  std::vector<std::int32_t> u, v, h;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::array<std::vector<std::uint32_t>, 4> edges;  // west, south, east, north
  std::vector<std::array<std::uint8_t, 2>> normals;
  bool has_water_mask = false;
  std::vector<std::uint8_t> water_mask;  // of a whole one: 1 or 65536 bytes
  std::string metadata;

  /// As a client computes it.
  double height(std::size_t i) const {
    return min_height + h[i] * (max_height - min_height) / 32767.0;
  }
};

/// Reads `bytes` (not compressed) and reports what breaks a rule under `where`. False when so much
/// is wrong that looking at the mesh makes no sense.
bool check_decode(std::span<const std::uint8_t> bytes, const std::string& where, CheckedTile&,
                  Findings&);

}  // namespace tind
