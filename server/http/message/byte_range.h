#pragma once
// A part of a body, as a client asks for it (RFC 9110, section 14).

#include <cstddef>
#include <string_view>

namespace tind::http {

struct AskedRange {
  enum class Kind { whole, part, beyond };  // beyond: nothing of it is there (416)
  Kind kind = Kind::whole;
  std::size_t first = 0, count = 0;  // of a part
};

/// What a Range field asks of `size` bytes: "bytes=0-99", "bytes=500-" and "bytes=-100". Several
/// ranges at a time, other units and what is malformed ask for the whole, as the RFC lets a server
/// take them.
AskedRange asked_range(std::string_view field, std::size_t size);

}  // namespace tind::http
