// GeographicLib does the work.

#include "terrain/geo/geoid.h"

#include <GeographicLib/Geoid.hpp>
#include <exception>

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
  } catch (const std::exception& e) {
    return fail(Errc::bad_data, "the geoid grid " + folder + "/" + name + ".pgm: " + e.what() +
                                    "; make it anew with scripts/make_geoid");
  }
}

}  // namespace tind
