// Any text: no crash; what is read can be written and read again.

#include <cstdint>
#include <cstdlib>

#include "proto/tile/layer_json.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind::proto;
  const auto layer = decode_layer_json({reinterpret_cast<const char*>(data), size});
  if (!layer) {
    if (layer.error().what.empty()) std::abort();
    return 0;
  }
  layer->contains(3, 1, 1);
  const std::string text = encode_layer_json(*layer);
  const auto again = decode_layer_json(text);
  if (!again || encode_layer_json(*again) != text) std::abort();
  return 0;
}
