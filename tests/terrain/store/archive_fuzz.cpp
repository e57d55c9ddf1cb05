// Any bytes as an archive of tiles, PMTiles or MBTiles: opened, read, listed and verified it gives
// errors with a reason, or tiles within the limit; never a crash.

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "terrain/check/verify_store.h"
#include "terrain/store/open/open_store.h"
#include "terrain/store/tile_store.h"
#include "tests/support/fuzz_bytes.h"

namespace {

using namespace tind;
using test::require;

/// One file for all inputs, gone with the process.
struct Place {
  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("tind-archive-fuzz-" + std::to_string(getpid()));
  Place() { std::filesystem::create_directories(folder); }
  ~Place() { std::filesystem::remove_all(folder); }
};

void use(const TileStore& store) {
  const auto layer = store.layer_json();
  require(layer || !layer.error().what.empty(), "no reason");
  (void)store.record();
  (void)store.kept_blocks();
  for (const TileId id : {TileId{0, 0, 0}, TileId{1, 3, 1}, TileId{9, 500, 300}}) {
    const auto tile = store.read(id);
    require(tile ? tile->size() <= kLargestStored : !tile.error().what.empty(), "a tile too large");
    (void)store.size(id);
  }
  (void)store.list();
  (void)store.generation();
  (void)store.vouched_for();
  (void)store.faults();
  const auto report = verify_store(store, 1);
  require(report || !report.error().what.empty(), "no reason");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Place place;
  const bool database = size > 6 && data[0] == 'S' && data[1] == 'Q';
  const std::string file = (place.folder / (database ? "a.mbtiles" : "a.pmtiles")).string();
  std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(data), long(size));
  use(*open_store(file));
  std::filesystem::remove(file);
  return 0;
}
