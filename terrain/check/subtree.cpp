// A header of 24 bytes, JSON, and a buffer. Lengths and places are compared with the bytes that are
// there before any bit is looked at.

#include "terrain/check/subtree.h"

#include "proto/json_member.h"
#include "proto/json_text.h"
#include "terrain/base/bytes.h"

namespace tind {
namespace {

using Json = nlohmann::json;

constexpr std::uint32_t kMagic = 0x74627573;     // "subt"
constexpr std::size_t kHeader = 24;              // bytes
constexpr std::int64_t kMost = 1ll << 40;        // of a length that is looked at
constexpr std::size_t kMostValues = 10'000'000;  // of JSON; each takes up to 100 bytes

const Json& list(const Json& object, const char* name) {
  static const Json kNone = Json::array();
  const Json* const found = json::member(object, name);
  return found && found->is_array() ? *found : kNone;
}

/// False where what is said makes no sense.
bool read_bits(const Json* said, const Json& views, std::string_view buffer, std::uint64_t count,
               SubtreeBits& out) {
  if (!said) return false;
  if (const auto constant = json::whole(*said, "constant", 0, 1)) {
    out = SubtreeBits(*constant == 1);
    return true;
  }
  const auto view = json::whole(*said, "bitstream", 0, std::int64_t(views.size()) - 1);
  if (!view) return false;
  const Json& v = views[std::size_t(*view)];
  const auto offset = json::whole_or(v, "byteOffset", 0, 0, kMost);
  const auto size = json::whole(v, "byteLength", 1, kMost);
  if (!offset || !size || *offset + *size > std::int64_t(buffer.size()) ||
      std::uint64_t(*size) < (count + 7) / 8)
    return false;
  out = SubtreeBits(buffer.substr(std::size_t(*offset), std::size_t(*size)));
  return true;
}

}  // namespace

std::uint64_t subtree_morton(std::uint64_t x, std::uint64_t y) {
  std::uint64_t number = 0;
  for (int bit = 0; bit < 32; ++bit)
    number |= (x >> bit & 1) << (2 * bit) | (y >> bit & 1) << (2 * bit + 1);
  return number;
}

Result<ReadSubtree> read_subtree(std::string_view bytes, int levels) {
  const auto wrong = [](const char* what) { return fail(Errc::bad_data, what); };
  if (bytes.size() < kHeader || load<std::uint32_t>(bytes.data()) != kMagic)
    return wrong("is no subtree");
  if (load<std::uint32_t>(&bytes[4]) != 1) return wrong("is not of version 1");
  const auto text = load<std::uint64_t>(&bytes[8]), binary = load<std::uint64_t>(&bytes[16]);
  if (text > bytes.size() - kHeader || binary != bytes.size() - kHeader - text)
    return wrong("has another length than it says");
  const std::string_view said = bytes.substr(kHeader, text);
  if (json::count_values(said) > kMostValues) return wrong("has too much JSON");
  const Json json = json::parse<Json>(said);
  if (!json.is_object()) return wrong("its JSON is damaged");
  const std::string_view buffer = bytes.substr(kHeader + text);
  const Json& views = list(json, "bufferViews");
  const Json& contents = list(json, "contentAvailability");
  const std::uint64_t tiles = tiles_in_subtree(levels);
  ReadSubtree out;
  if (!read_bits(json::member(json, "tileAvailability"), views, buffer, tiles, out.tiles))
    return wrong("does not say which tiles there are");
  if (!contents.empty() && !read_bits(&contents[0], views, buffer, tiles, out.contents))
    return wrong("does not say which contents there are");
  if (!read_bits(json::member(json, "childSubtreeAvailability"), views, buffer,
                 std::uint64_t(1) << 2 * levels, out.children))
    return wrong("does not say which subtrees follow");
  return out;
}

}  // namespace tind
