#include "server/cli/pictures/png.h"

#include <algorithm>
#include <string_view>

#include "proto/image/png.h"

namespace tind::cli {

namespace {

std::string base64(std::string_view in) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve(in.size() * 4 / 3 + 4);
  for (std::size_t i = 0; i < in.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, in.size() - i);
    std::uint32_t v = 0;
    for (std::size_t k = 0; k < 3; ++k) v = v << 8 | (k < n ? std::uint8_t(in[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += k <= n ? kDigits[v >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

}  // namespace

std::string encode_png(const Picture& picture) {
  const auto* samples = reinterpret_cast<const std::uint8_t*>(picture.pixels.data());
  return proto::encode_png(picture.width, picture.height, 3, {samples, 3 * picture.pixels.size()});
}

std::string png_data_uri(const Picture& picture) {
  return "data:image/png;base64," + base64(encode_png(picture));
}

}  // namespace tind::cli
