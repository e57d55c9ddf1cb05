// Any bytes: no crash, and memory in proportion; what is read can be written and read again.

#include <cstdint>
#include <cstdlib>

#include "proto/mesh_io.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind::proto;
  const auto mesh = decode_obj({reinterpret_cast<const char*>(data), size});
  if (!mesh) {
    if (mesh.error().empty() || mesh.error().find('\n') != std::string::npos) std::abort();
    return 0;
  }
  if (mesh->triangles.size() > size || mesh->positions.size() > size + 2) std::abort();
  for (const auto& triangle : mesh->triangles)
    for (const std::uint32_t index : triangle)
      if (index >= mesh->positions.size()) std::abort();
  const auto again = decode_ply(encode_ply(*mesh));
  if (!again || again->positions != mesh->positions || again->triangles != mesh->triangles)
    std::abort();
  return 0;
}
