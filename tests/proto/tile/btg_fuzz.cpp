// What is read can be written and read again, and is the same.

#include <cstdint>

#include "proto/tile/btg.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto btg = tind::proto::decode_btg({data, size});
  if (!btg) return 0;
  for (const auto& part : btg->parts) {
    if (part.material.size() > 255) return 0;
    for (const auto& triangle : part.triangles)
      for (const auto& corner : triangle)
        if (corner.vertex >= btg->vertices.size() || corner.normal >= btg->normals.size() ||
            corner.texcoord >= btg->texcoords.size())
          __builtin_trap();
  }
  const auto bytes = tind::proto::encode(*btg);
  const auto again = tind::proto::decode_btg(bytes);
  if (!again || tind::proto::encode(*again) != bytes) __builtin_trap();
  return 0;
}
