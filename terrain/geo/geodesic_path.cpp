#include "terrain/geo/geodesic_path.h"

#include <GeographicLib/Geodesic.hpp>
#include <algorithm>

namespace tind {

namespace {

const GeographicLib::Geodesic& wgs84_geodesic() { return GeographicLib::Geodesic::WGS84(); }

}  // namespace

GeodesicPath::GeodesicPath(std::span<const Geographic> places)
    : places_(places.begin(), places.end()), reached_m_{0} {
  for (std::size_t i = 1; i < places_.size(); ++i) {
    const Geographic &a = places_[i - 1], &b = places_[i];
    double metres = 0, from = 0, to = 0;
    wgs84_geodesic().Inverse(a.lat, a.lon, b.lat, b.lon, metres, from, to);
    reached_m_.push_back(reached_m_.back() + metres);
    azimuths_.push_back(from);
  }
}

Geographic GeodesicPath::at(double metres) const {
  const auto after = std::ranges::upper_bound(reached_m_, metres);
  if (after == reached_m_.begin()) return places_.front();
  const auto i = std::size_t(after - reached_m_.begin()) - 1;
  if (i + 1 >= places_.size()) return places_.back();
  const double beyond = metres - reached_m_[i];
  if (beyond == 0) return places_[i];
  Geographic place;
  wgs84_geodesic().Direct(places_[i].lat, places_[i].lon, azimuths_[i], beyond, place.lat,
                          place.lon);
  return place;
}

Geographic GeodesicPath::beside(double metres, double right_m) const {
  const auto after = std::ranges::upper_bound(reached_m_, std::max(metres, 0.0));
  auto i = std::min(std::size_t(after - reached_m_.begin()), azimuths_.size()) - 1;
  while (i > 0 && reached_m_[i + 1] == reached_m_[i]) --i;  // a leg of no length has no direction
  const double beyond = std::clamp(metres, 0.0, length_m()) - reached_m_[i];
  Geographic on, place;
  double ahead = 0;
  wgs84_geodesic().Direct(places_[i].lat, places_[i].lon, azimuths_[i], beyond, on.lat, on.lon,
                          ahead);
  wgs84_geodesic().Direct(on.lat, on.lon, ahead + 90, right_m, place.lat, place.lon);
  return place;
}

std::vector<Geographic> GeodesicPath::evenly(std::size_t count) const {
  std::vector<Geographic> out;
  for (std::size_t i = 0; i + 1 < count; ++i)
    out.push_back(at(length_m() * double(i) / double(count - 1)));
  out.push_back(places_.back());
  return out;
}

}  // namespace tind
