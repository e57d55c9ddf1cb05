#include "terrain/geo/geoid_grids.h"

#include <GeographicLib/Geoid.hpp>
#include <algorithm>
#include <exception>
#include <filesystem>
#include <new>

#include "terrain/base/file_there.h"
#include "terrain/geo/no_grid.h"

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

Result<std::string> folder_of_geoid(const std::string& name,
                                    const std::vector<std::string>& folders) {
  for (const std::string& folder : folders) {
    const auto type = file_type_of(folder + "/" + name + ".pgm");
    if (!type) return std::unexpected(type.error());
    if (*type == std::filesystem::file_type::regular) return folder;
  }
  return std::string();
}

Result<std::shared_ptr<const Geoid>> cubic_geoid(const std::string& folder,
                                                 const std::string& name) {
  try {
    return std::make_shared<const CubicGeoid>(folder, name);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    const std::string path = folder + "/" + name + ".pgm";
    return no_grid(path, path + " is no grid of a geoid as GeographicLib has them: " + e.what());
  }
}

}  // namespace tind
