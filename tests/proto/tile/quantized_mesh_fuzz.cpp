// Any bytes: no crash; what decodes is re-encoded and decodes to the same bytes again.

#include <cstdlib>

#include "proto/tile/quantized_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind::proto;
  const std::span bytes(data, size);
  const auto first = decode(bytes);
  if (!first) {
    if (first.error().what.empty()) std::abort();
    return 0;
  }
  const auto encoded = encode(*first);
  const auto second = decode(encoded);
  if (!second || encode(*second) != encoded) std::abort();
  if (!decode(strip_extensions(bytes, {.metadata = true}))) std::abort();
  QuantizedMesh arranged = *first;
  arrange(arranged);
  const auto third = decode(encode(arranged));
  if (!third || third->triangles != arranged.triangles) std::abort();
  return 0;
}
