// Any bytes: no crash; what decodes as a whole is re-encoded and decodes to the same again.

#include <cstdlib>

#include "proto/stream/mesh_stream.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind::proto;
  const auto first = decode_mesh_stream({data, size});
  if (!first) {
    if (first.error().what.empty()) std::abort();
    return 0;
  }
  if (first->splits.size() < first->total_splits) return 0;
  const auto bytes = encode(*first);
  if (!bytes) std::abort();
  const auto second = decode_mesh_stream(*bytes);
  if (!second || second->splits != first->splits || second->blocks != first->blocks) std::abort();
  return 0;
}
