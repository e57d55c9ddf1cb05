// Any bytes: no crash; what decodes comes back the same when it is encoded and decoded again.

#include <cstdlib>

#include "proto/stream/refine_delta.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind::proto;
  const auto first = decode_refine_delta({reinterpret_cast<const char*>(data), size});
  if (!first) {
    if (first.error().what.empty()) std::abort();
    return 0;
  }
  // Bytes, not numbers: a coordinate may be NaN.
  const std::string bytes = encode(*first);
  const auto second = decode_refine_delta(bytes);
  if (!second || encode(*second) != bytes) std::abort();
  return 0;
}
