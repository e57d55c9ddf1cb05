// Text from strangers' queries and bodies: WKT, base64, JSON. Refused, or within the stated limits;
// how much JSON there is, is known before any of it is built.

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "proto/base64.h"
#include "proto/json_text.h"
#include "proto/wkt.h"
#include "tests/support/fuzz_bytes.h"

namespace {

using tind::test::require;

/// Members of the object with most of them.
std::size_t members(const nlohmann::json& json) {
  std::size_t most = json.is_object() ? json.size() : 0;
  if (json.is_structured())
    for (const auto& inner : json) most = std::max(most, members(inner));
  return most;
}

/// Values within a value, and itself.
std::size_t values(const nlohmann::json& json) {
  std::size_t count = 1;
  if (json.is_structured())
    for (const auto& inner : json) count += values(inner);
  return count;
}

void wkt(std::string_view text) {
  constexpr std::size_t kMost = 100;
  const auto shape = tind::proto::decode_wkt(text, kMost);
  if (!shape) return require(!shape.error().what.empty(), "no reason");
  std::size_t places = 0;
  for (const auto& part : shape->parts)
    for (const auto& line : part) places += line.size();
  require(places > 0 && places <= kMost, "more places than may be");
}

void base64(std::string_view text) {
  const auto bytes = tind::proto::decode_base64(text);
  if (!bytes) return;
  require(bytes->size() <= text.size(), "more bytes than text");
  std::string again;
  tind::proto::put_base64(again, *bytes);
  require(tind::proto::decode_base64(again) == bytes, "other bytes when written");
}

void json(std::string_view text) {
  const std::size_t counted = tind::json::count_values(text);
  (void)tind::json::too_deep(text);
  const auto made = tind::json::parse<nlohmann::json>(text);
  if (made.is_discarded()) return;
  require(!tind::json::too_deep(text), "too deep, and taken");
  require(values(made) <= counted + 1, "more values than were counted");
  require(members(made) <= tind::json::most_members(text), "more members than were counted");
  const std::string again = tind::json::to_text(made);
  require(!tind::json::parse<nlohmann::json>(again).is_discarded(), "what is written is no JSON");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  wkt(text);
  base64(text);
  json(text);
  return 0;
}
