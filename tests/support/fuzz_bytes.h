#pragma once
// For fuzz targets that make their input from bytes: taking them one by one, and saying which
// promise is broken.

#include <cstdint>
#include <cstdio>
#include <cstdlib>

namespace tind::test {

inline void require(bool ok, const char* what) {
  if (ok) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

struct FuzzBytes {
  const std::uint8_t* data;
  std::size_t size;
  unsigned next() { return size == 0 ? 0 : (--size, *data++); }
};

}  // namespace tind::test
