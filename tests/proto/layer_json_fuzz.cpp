// Any text: no crash; what is read can be written and read again.

#include <cstdint>
#include <cstdlib>

#include "proto/layer_json.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind::proto;
  std::string error;
  const auto layer = decode_layer_json({reinterpret_cast<const char*>(data), size}, error);
  if (!layer) {
    if (error.empty()) std::abort();
    return 0;
  }
  layer->contains(3, 1, 1);
  const std::string text = encode_layer_json(*layer);
  const auto again = decode_layer_json(text, error);
  if (!again || encode_layer_json(*again) != text) std::abort();
  return 0;
}
