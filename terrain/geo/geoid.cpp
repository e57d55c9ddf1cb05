// GeographicLib does the work.

#include "terrain/geo/geoid.h"

#include <GeographicLib/Geoid.hpp>
#include <exception>
#include <new>

#include "terrain/geo/no_grid.h"

namespace tind {
namespace {

class GridGeoid final : public Geoid {
 public:
  GridGeoid(const std::string& folder, const std::string& name)
      : grid_(name, folder, /*cubic=*/false, /*threadsafe=*/true) {}
  double undulation(Geographic p) const override { return grid_(p.lat, p.lon); }

 private:
  GeographicLib::Geoid grid_;
};

}  // namespace

Result<std::shared_ptr<const Geoid>> Geoid::load(const std::string& folder,
                                                 const std::string& name) {
  try {
    return std::make_shared<const GridGeoid>(folder, name);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    const std::string path = folder + "/" + name + ".pgm";
    return no_grid(path, "the geoid grid " + path + ": " + e.what() +
                             "; make it anew with scripts/make_geoid");
  }
}

}  // namespace tind
