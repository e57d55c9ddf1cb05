#include "terrain/store/mbtiles/mbtiles_seal.h"

#include <array>
#include <charconv>
#include <cstdio>

namespace tind::mbtiles {

namespace {

constexpr std::string_view kVersion = "1";
constexpr std::size_t kDigits = 16;

}  // namespace

/// The version, and four numbers of sixteen hexadecimal digits.
std::string encode(const Seal& s) {
  std::string text(kVersion);
  for (const std::uint64_t n : {s.head, s.tiles, s.entries, s.blocks}) {
    std::array<char, 20> word;
    std::snprintf(word.data(), word.size(), " %016llx", static_cast<unsigned long long>(n));
    text += word.data();
  }
  return text;
}

std::optional<Seal> decode_seal(std::string_view text) {
  if (!text.starts_with(kVersion)) return {};
  text.remove_prefix(kVersion.size());
  Seal s;
  for (std::uint64_t* n : {&s.head, &s.tiles, &s.entries, &s.blocks}) {
    if (text.size() < kDigits + 1 || text[0] != ' ') return {};
    const char* const end = text.data() + kDigits + 1;
    const auto read = std::from_chars(text.data() + 1, end, *n, 16);
    if (read.ec != std::errc() || read.ptr != end) return {};
    text.remove_prefix(kDigits + 1);
  }
  if (!text.empty()) return {};
  return s;
}

}  // namespace tind::mbtiles
