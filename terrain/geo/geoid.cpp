// GeographicLib does the work; here is where its file is found.

#include "terrain/geo/geoid.h"

#include <unistd.h>

#include <GeographicLib/Geoid.hpp>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <mutex>
#include <vector>

namespace tind {
namespace {

namespace fs = std::filesystem;
constexpr char kName[] = "egm96-15";

class GridGeoid final : public Geoid {
 public:
  GridGeoid(const std::string& folder, const std::string& name)
      : grid_(name, folder, /*cubic=*/false, /*threadsafe=*/true) {}
  double undulation(Geographic p) const override { return grid_(p.lat, p.lon); }

 private:
  GeographicLib::Geoid grid_;
};

std::vector<fs::path> folders() {
  std::vector<fs::path> found;
  if (const char* data = std::getenv("TIND_DATA")) found.push_back(fs::path(data) / "geoids");
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (!error) found.push_back(program.parent_path().parent_path() / "share/tind/geoids");
#ifdef TIND_GEOID_DIR
  found.push_back(TIND_GEOID_DIR);
#endif
  return found;
}

Result<std::shared_ptr<const Geoid>> find_egm96() {
  std::string searched;
  for (const fs::path& folder : folders()) {
    std::error_code error;
    if (fs::exists(folder / (std::string(kName) + ".pgm"), error))
      return Geoid::load(folder.string(), kName);
    searched += (searched.empty() ? "" : ", ") + folder.string();
  }
  return fail(Errc::not_found, "the EGM96 geoid grid egm96-15.pgm is missing (looked in " +
                                   searched + "); make it with scripts/make_geoid");
}

}  // namespace

Result<std::shared_ptr<const Geoid>> Geoid::load(const std::string& folder,
                                                 const std::string& name) {
  try {
    return std::make_shared<const GridGeoid>(folder, name);
  } catch (const std::exception& e) {
    return fail(Errc::bad_data, "the geoid grid " + folder + "/" + name + ".pgm: " + e.what() +
                                    "; make it anew with scripts/make_geoid");
  }
}

Result<std::shared_ptr<const Geoid>> Geoid::egm96() {
  static std::mutex mutex;
  static std::shared_ptr<const Geoid> loaded;
  const std::lock_guard lock(mutex);
  if (loaded) return loaded;
  auto found = find_egm96();
  if (found) loaded = *found;
  return found;
}

}  // namespace tind
