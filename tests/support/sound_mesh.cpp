#include "tests/support/sound_mesh.h"

#include <cstdint>
#include <cstdlib>

namespace tind::test {

int expect_sound_mesh(const Result<proto::Mesh>& read, std::size_t size) {
  if (!read) {
    if (read.error().what.empty() || read.error().what.find('\n') != std::string::npos)
      std::abort();
    return 0;
  }
  if (read->triangles.size() > size || read->positions.size() > size + 2) std::abort();
  for (const auto& triangle : read->triangles)
    for (const std::uint32_t index : triangle)
      if (index >= read->positions.size()) std::abort();
  const auto again = proto::decode_ply(proto::encode_ply(*read));
  if (!again || again->positions != read->positions || again->triangles != read->triangles)
    std::abort();
  return 0;
}

}  // namespace tind::test
