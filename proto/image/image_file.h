#pragma once
// Pictures as files, in whichever format: the same pixels in all of them.

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/image/png.h"
#include "proto/image/webp.h"
#include "terrain/base/enum_names.h"

namespace tind {

namespace proto {

enum class ImageFormat : std::uint8_t { png, webp };

/// 8 bits a channel, as encode_png() has them, with what the file says of them in ASCII.
struct ImagePixels {
  int width = 0, height = 0, channels = 0;
  std::vector<std::uint8_t> samples;
  std::vector<PngText> texts;
  WebpEffort effort = WebpEffort::quick;
};

/// PNG: texts in tEXt chunks. WebP: without loss; texts as lines "keyword: text" of its description
/// (webp.h).
std::string encode_image(const ImagePixels&, ImageFormat);

/// As is_whole_png() and is_whole_webp() say.
bool is_whole_image(std::string_view bytes, ImageFormat);

std::string_view media_type(ImageFormat);

}  // namespace proto

/// Also what their files' names end with.
template <>
struct EnumNames<proto::ImageFormat> {
  static constexpr const char* kWhat = "format of images";
  static constexpr std::pair<proto::ImageFormat, const char*> kAll[] = {
      {proto::ImageFormat::png, "png"}, {proto::ImageFormat::webp, "webp"}};
};

}  // namespace tind
