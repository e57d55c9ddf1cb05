#include <cstdint>

#include "tests/support/sound_mesh.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return tind::test::expect_sound_mesh(
      tind::proto::decode_2dm({reinterpret_cast<const char*>(data), size}), size);
}
