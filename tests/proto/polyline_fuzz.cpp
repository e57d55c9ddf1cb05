// Polylines from strangers: what is read is written back the same, but for numbers that took more
// characters than they need.

#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "proto/polyline.h"

using namespace tind::proto;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const int digits = 1 + data[0] % 7;
  const auto places = decode_polyline(text, digits, 1000);
  if (!places) return 0;
  const std::string again = encode_polyline(*places, digits);
  if (again.size() > text.size() || decode_polyline(again, digits, 1000) != *places) std::abort();
  return 0;
}
