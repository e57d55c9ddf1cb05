#pragma once
// Bytes as text: RFC 4648, section 4, with padding.

#include <optional>
#include <string>
#include <string_view>

namespace tind::proto {

/// Appends.
void put_base64(std::string& out, std::string_view bytes);

/// Nothing for what is none: other characters, white space among them, a length that is no multiple
/// of four, bits behind the last byte that are not zero.
std::optional<std::string> decode_base64(std::string_view text);

}  // namespace tind::proto
