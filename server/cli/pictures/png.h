#pragma once
// Pictures as PNG files in memory.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace tind::cli {

struct Picture {
  int width = 0, height = 0;
  std::vector<std::array<std::uint8_t, 3>> pixels;  // rows from the top

  Picture(int w, int h, std::array<std::uint8_t, 3> fill)
      : width(w), height(h), pixels(std::size_t(w) * h, fill) {}
  std::array<std::uint8_t, 3>& at(int x, int y) { return pixels[std::size_t(y) * width + x]; }
};

/// 8 bits RGB, filtered by `up` and deflated.
std::string encode_png(const Picture&);

/// "data:image/png;base64,...", for pages that stand alone.
std::string png_data_uri(const Picture&);

}  // namespace tind::cli
