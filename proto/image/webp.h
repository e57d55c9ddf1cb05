#pragma once
// WebP without loss, as it is written: the VP8L bitstream of libwebp in the extended container of
// RFC 9649.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace tind::proto {

/// How long libwebp looks for what repeats. `thorough` takes four times as long; of meshes' heights
/// it saves a tenth to a fifth, of posts' heights, which are noise to it, nothing.
enum class WebpEffort { quick, thorough };

/// `samples` and `channels` as encode_png() has them; the colours under an alpha of 0 stay. Where
/// there is a text, it is the description (dc:description) in an XMP chunk: `text` is UTF-8, and
/// what XML does not allow must not be in it. WebP has no checksums, so the last chunk is one,
/// which readers pass over: "TCRC", the CRC-32 of all bytes before it, big endian.
/// The same bytes of any thread. REQUIRES: both sides within 1..16383.
std::string encode_webp(int width, int height, int channels, std::span<const std::uint8_t> samples,
                        std::string_view text = {}, WebpEffort = WebpEffort::quick);

/// Is it one file as encode_webp() makes them, from beginning to end, with the right checksum?
bool is_whole_webp(std::string_view bytes);

}  // namespace tind::proto
