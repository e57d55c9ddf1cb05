// Any bytes: no crash; what decodes is re-encoded and decodes to the same bytes again.

#include <cstdlib>

#include "proto/quantized_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind::proto;
  const std::span bytes(data, size);
  std::string error;
  const auto first = decode(bytes, error);
  if (!first) {
    if (error.empty()) std::abort();
    return 0;
  }
  const auto encoded = encode(*first);
  const auto second = decode(encoded, error);
  if (!second || encode(*second) != encoded) std::abort();
  if (!decode(strip_extensions(bytes, {.metadata = true}), error)) std::abort();
  QuantizedMesh arranged = *first;
  arrange(arranged);
  const auto third = decode(encode(arranged), error);
  if (!third || third->triangles != arranged.triangles) std::abort();
  return 0;
}
