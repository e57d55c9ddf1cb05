// Any bytes as a zip archive: an error, or an entry within its bounds.

#include <cstdint>
#include <cstdlib>

#include "terrain/raster/gdal/heights/zip_entry.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMost = 1 << 16;
  const auto entry = tind::zip_entry({data, size}, "fuzz.zip", {".hgt"}, kMost);
  if (entry && (entry->bytes.size() > kMost || entry->name.size() < 4)) std::abort();
  if (!entry && entry.error().what.empty()) std::abort();
  return 0;
}
