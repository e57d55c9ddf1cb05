// libwebp makes the picture; the container around it is few bytes and is made here.

#include "proto/image/webp.h"

#include <webp/encode.h>

#include <cassert>
#include <memory>
#include <vector>

#include "terrain/base/bytes.h"
#include "terrain/base/deflate.h"

namespace tind::proto {
namespace {

/// What libwebp calls method and, where nothing is lost, quality.
struct Search {
  int method;
  float quality;
};
// For pictures of posts; higher ones of either save at most 3 % and take two to sixty times as
// long.
constexpr Search kQuick = {1, 20};
// For those of planes: higher ones save at most 3 % more.
constexpr Search kThorough = {3, 50};

constexpr std::string_view kChecksum = "TCRC";
constexpr std::size_t kHead = 12, kAround = 8, kChecksumChunk = kAround + sizeof(std::uint32_t);

/// As libwebp takes them: four bytes a pixel.
std::vector<std::uint8_t> rgba(int channels, std::span<const std::uint8_t> samples) {
  std::vector<std::uint8_t> out;
  const auto step = std::size_t(channels);
  out.reserve(samples.size() / step * 4);
  const bool grey = channels < 3, opaque = channels % 2 == 1;
  for (std::size_t k = 0; k < samples.size(); k += step) {
    const std::uint8_t* const s = &samples[k];
    const std::uint8_t last = s[step - 1];
    out.insert(out.end(),
               {s[0], grey ? s[0] : s[1], grey ? s[0] : s[2], opaque ? std::uint8_t(255) : last});
  }
  return out;
}

/// The file that libwebp writes: "RIFF", its size, "WEBP" and one chunk, "VP8L".
std::string vp8l_file(int width, int height, int channels, std::span<const std::uint8_t> samples,
                      Search search) {
  WebPConfig config;
  WebPPicture picture;
  [[maybe_unused]] bool good = WebPConfigInit(&config) && WebPPictureInit(&picture);
  assert(good);  // else it is another version of the library than its header
  config.lossless = config.exact = 1;
  config.method = search.method;
  config.quality = search.quality;
  picture.use_argb = 1;
  picture.width = width;
  picture.height = height;
  std::string out;
  picture.custom_ptr = &out;
  picture.writer = [](const std::uint8_t* data, std::size_t size, const WebPPicture* p) {
    static_cast<std::string*>(p->custom_ptr)->append(reinterpret_cast<const char*>(data), size);
    return 1;
  };
  const std::unique_ptr<WebPPicture, decltype(&WebPPictureFree)> guard(&picture, WebPPictureFree);
  const auto pixels = rgba(channels, samples);
  if (!WebPPictureImportRGBA(&picture, pixels.data(), 4 * width) ||
      !WebPEncode(&config, &picture)) {
    assert(picture.error_code == VP8_ENC_ERROR_OUT_OF_MEMORY);
    throw std::bad_alloc();
  }
  return out;
}

template <class T>
void put(std::string& out, T value) {
  out.resize(out.size() + sizeof value);
  store<std::endian::little>(value, out.data() + out.size() - sizeof value);
}

void put_chunk(std::string& out, std::string_view type, std::string_view data) {
  out += type;
  put(out, std::uint32_t(data.size()));
  out += data;
  if (data.size() % 2 == 1) out += '\0';
}

/// 2.7 of the RFC: what the file has, and how large the picture is.
std::string feature_chunk(int width, int height, bool alpha, bool xmp) {
  std::string out;
  put(out, std::uint32_t((alpha ? 0x10 : 0) | (xmp ? 0x04 : 0)));
  for (const int side : {width, height})
    for (const int shift : {0, 8, 16}) out += char((side - 1) >> shift);
  return out;
}

std::string as_xml(std::string_view text) {
  std::string out;
  for (const char c : text)
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else
      out += c;
  return out;
}

std::string xmp(std::string_view description) {
  return "<x:xmpmeta xmlns:x=\"adobe:ns:meta/\">"
         "<rdf:RDF xmlns:rdf=\"http://www.w3.org/1999/02/22-rdf-syntax-ns#\">"
         "<rdf:Description rdf:about=\"\" xmlns:dc=\"http://purl.org/dc/elements/1.1/\">"
         "<dc:description><rdf:Alt><rdf:li xml:lang=\"x-default\">" +
         as_xml(description) +
         "</rdf:li></rdf:Alt></dc:description></rdf:Description></rdf:RDF></x:xmpmeta>";
}

}  // namespace

std::string encode_webp(int width, int height, int channels, std::span<const std::uint8_t> samples,
                        std::string_view text, WebpEffort effort) {
  assert(channels >= 1 && channels <= 4 &&
         samples.size() == std::size_t(width) * std::size_t(channels) * std::size_t(height));
  assert(width >= 1 && height >= 1 && width <= WEBP_MAX_DIMENSION && height <= WEBP_MAX_DIMENSION);
  const Search search = effort == WebpEffort::quick ? kQuick : kThorough;
  const std::string picture = vp8l_file(width, height, channels, samples, search).substr(kHead);
  std::string out = "RIFF....WEBP";
  put_chunk(out, "VP8X", feature_chunk(width, height, channels % 2 == 0, !text.empty()));
  out += picture;
  if (!text.empty()) put_chunk(out, "XMP ", xmp(text));
  store<std::endian::little>(std::uint32_t(out.size() + kChecksumChunk - kAround), out.data() + 4);
  std::string checksum(4, '\0');
  store<std::endian::big>(crc32(out), checksum.data());
  put_chunk(out, kChecksum, checksum);
  return out;
}

bool is_whole_webp(std::string_view bytes) {
  if (bytes.size() < kHead + kChecksumChunk || !bytes.starts_with("RIFF") ||
      bytes.substr(8, 4) != "WEBP")
    return false;
  if (load<std::uint32_t, std::endian::little>(bytes.data() + 4) != bytes.size() - kAround)
    return false;
  const std::string_view before = bytes.substr(0, bytes.size() - kChecksumChunk);
  std::string_view chunk = bytes.substr(before.size());
  return chunk.starts_with(kChecksum) &&
         load<std::uint32_t, std::endian::little>(chunk.data() + 4) == 4 &&
         load<std::uint32_t, std::endian::big>(chunk.data() + kAround) == crc32(before);
}

}  // namespace tind::proto
