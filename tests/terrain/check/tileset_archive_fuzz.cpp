// Any bytes as a .3tz: an error, or files within their limits whose check ends with a report; and
// what it finds right is right again.

#include <cstdint>
#include <cstdlib>
#include <sstream>
#include <string>

#include "terrain/check/check_glb.h"
#include "terrain/check/check_tileset.h"

namespace {

void require(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  (void)wrong_with_glb(bytes);
  const auto files =
      TilesetFiles::of_archive(std::make_unique<std::istringstream>(bytes), size, "fuzz.3tz");
  if (!files) {
    require(!files.error().what.empty());
    return 0;
  }
  for (const auto& [name, packed] : (*files)->sizes()) {
    const auto file = (*files)->read(name);
    // DEFLATE makes at most 1100 bytes of one.
    require(file ? file->size() <= 1100 * (size + 1) : !file.error().what.empty());
  }
  (void)tileset_facts(**files);
  const auto report = check_tileset(**files);
  require(report && report->ok() == report->examples.empty());
  require(report->violations <= TilesetReport::kMost + 1);
  return 0;
}
