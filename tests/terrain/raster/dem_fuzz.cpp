// Any bytes as a DEM: refused with a reason, or its posts are read, or refused; finite or void. The
// first byte says what the file is called.

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "terrain/raster/dem_source.h"
#include "tests/support/fuzz_bytes.h"

namespace {

using namespace tind;
using test::require;

struct Place {
  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("tind-dem-fuzz-" + std::to_string(getpid()));
  Place() { std::filesystem::create_directories(folder); }
  ~Place() { std::filesystem::remove_all(folder); }
};

void read(const DemSource& source) {
  const DemInfo& info = source.info();
  require(info.cols > 0 && info.rows > 0, "no posts");
  const int cols = int(std::min<std::int64_t>(info.cols, 40)),
            rows = int(std::min<std::int64_t>(info.rows, 40));
  for (const std::int64_t row : {std::int64_t(0), info.rows - rows}) {
    const auto heights = source.read(0, row, cols, rows);
    if (!heights) {
      require(!heights.error().what.empty(), "no reason");
      continue;
    }
    for (const float h : heights->values()) require(!std::isinf(h), "neither a height nor a void");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Place place;
  static constexpr const char* kNames[] = {"d.tif", "d.asc", "d.png", "N47E008.hgt",
                                           "d.dt1", "d.dem", "d.img", "d.tif.zip"};
  if (size == 0) return 0;
  const std::string file = (place.folder / kNames[data[0] % std::size(kNames)]).string();
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(data) + 1, long(size) - 1);
  DemOptions options;
  const auto source = DemSource::open({&file, 1}, options);
  if (source)
    read(**source);
  else
    require(!source.error().what.empty(), "no reason");
  std::filesystem::remove(file);
  return 0;
}
