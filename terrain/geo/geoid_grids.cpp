#include "terrain/geo/geoid_grids.h"

#include <GeographicLib/Geoid.hpp>
#include <algorithm>
#include <exception>
#include <filesystem>

namespace tind {
namespace {

class CubicGeoid final : public Geoid {
 public:
  CubicGeoid(const std::string& folder, const std::string& name)
      : grid_(name, folder, /*cubic=*/true, /*threadsafe=*/true) {}
  double undulation(Geographic p) const override { return grid_(p.lat, p.lon); }

 private:
  GeographicLib::Geoid grid_;
};

}  // namespace

std::vector<std::string> geoid_folders(const std::string& first) {
  std::vector<std::string> folders;
  for (const std::string& folder : {first, GeographicLib::Geoid::DefaultGeoidPath(),
                                    std::string("/usr/share/GeographicLib/geoids"),
                                    std::string("/usr/local/share/GeographicLib/geoids")})
    if (!folder.empty() && std::ranges::find(folders, folder) == folders.end())
      folders.push_back(folder);
  return folders;
}

std::string folder_of_geoid(const std::string& name, const std::vector<std::string>& folders) {
  std::error_code error;
  for (const std::string& folder : folders)
    if (std::filesystem::is_regular_file(folder + "/" + name + ".pgm", error)) return folder;
  return {};
}

Result<std::shared_ptr<const Geoid>> cubic_geoid(const std::string& folder,
                                                 const std::string& name) {
  try {
    return std::make_shared<const CubicGeoid>(folder, name);
  } catch (const std::exception& e) {
    return fail(
        Errc::bad_data,
        folder + "/" + name + ".pgm is no grid of a geoid as GeographicLib has them: " + e.what());
  }
}

}  // namespace tind
