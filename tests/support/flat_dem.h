#pragma once
// A DEM of one height, which says by its height which of several it is.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>

#include "proto/tile/quantized_mesh.h"

namespace tind::test {

/// 200 x 200 posts of 0.001 degrees at 10 E 46 N, as an ASCII grid, moved into place.
inline void write_flat_dem(const std::string& path, int height) {
  const std::string before = path + "~";
  std::ofstream out(before);
  out << "ncols 200\nnrows 200\nxllcenter 10\nyllcenter 46\ncellsize 0.001\nNODATA_value -9999\n";
  for (int i = 0; i < 200 * 200; ++i) out << height << ' ';
  out.close();
  std::ofstream(path.substr(0, path.size() - 4) + ".prj")
      << R"(GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,)"
      << R"(298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]])";
  std::filesystem::rename(before, path);
}

/// The one height of the bytes of a tile inside such a DEM; nothing where they are no tile, or have
/// several.
inline std::optional<int> flat_height(std::string_view bytes) {
  const auto mesh =
      proto::decode({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  if (!mesh || mesh->h.empty()) return {};
  const double step = (double(mesh->max_height) - mesh->min_height) / 32767;
  const double height = std::round(mesh->min_height + mesh->h[0] * step);
  const bool flat = std::ranges::all_of(mesh->h, [&](std::uint16_t h) {
    return std::abs(mesh->min_height + h * step - height) < 1e-3;
  });
  if (!flat) return {};
  return int(height);
}

}  // namespace tind::test
