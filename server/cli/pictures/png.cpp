#include "server/cli/pictures/png.h"

#include "proto/base64.h"
#include "proto/image/png.h"

namespace tind::cli {

std::string encode_png(const Picture& picture) {
  const auto* samples = reinterpret_cast<const std::uint8_t*>(picture.pixels.data());
  return proto::encode_png(picture.width, picture.height, 3, {samples, 3 * picture.pixels.size()});
}

std::string png_data_uri(const Picture& picture) {
  std::string uri = "data:image/png;base64,";
  proto::put_base64(uri, encode_png(picture));
  return uri;
}

}  // namespace tind::cli
