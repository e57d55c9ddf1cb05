#include "server/cli/options/place_input.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <utility>

#include "terrain/raster/crs_points.h"

namespace tind::cli {

void add_places_crs(Command app, std::string& crs) {
  app.add_option("--places-crs", crs,
                 "what places are in: CRS84 (degrees) or EPSG:CODE, x (east) before y")
      .check([](const std::string& text) {
        return text == "CRS84" || is_epsg_code(text) ? "" : "takes CRS84 or EPSG:CODE";
      })
      .shown();
}

Result<std::vector<double>> read_numbers(const std::string& text, const char* option) {
  std::vector<double> out;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at < end) {
    double value = 0;
    const auto [stop, error] = std::from_chars(at, end, value);
    if (error != std::errc() || !std::isfinite(value))
      return fail(Errc::invalid_argument,
                  fmt::format("{}: '{}' is no list of numbers X,Y X,Y ...", option, text));
    out.push_back(value);
    at = stop;
    while (at < end && (*at == ',' || *at == ' ')) ++at;
  }
  return out;
}

Result<std::vector<Geographic>> read_places(const std::string& text, const char* option,
                                            const std::string& crs, Geographic near) {
  const auto n = read_numbers(text, option);
  if (!n) return std::unexpected(n.error());
  if (n->size() % 2 || n->empty())
    return fail(Errc::invalid_argument, fmt::format("{} takes pairs X,Y", option));
  std::vector<Vec2> points;
  for (std::size_t i = 0; i < n->size(); i += 2) points.push_back({(*n)[i], (*n)[i + 1]});
  return to_places(points, crs, near, [option](std::size_t) { return std::string(option); });
}

Result<std::vector<Geographic>> to_places(std::span<const Vec2> points, const std::string& crs,
                                          Geographic near,
                                          const std::function<std::string(std::size_t)>& named) {
  std::vector<Geographic> places;
  for (const Vec2& p : points) places.push_back({p.x, p.y});
  if (crs != "CRS84") {
    const auto system = CrsPoints::make(crs, near);
    if (!system) return fail("--places-crs", system.error());
    std::vector<Vec2> as_axes(points.begin(), points.end());
    if (!(*system)->east_first())
      for (Vec2& p : as_axes) std::swap(p.x, p.y);
    (*system)->to_geographic(as_axes, places);
  }
  for (std::size_t i = 0; i < places.size(); ++i)
    if (!(std::abs(places[i].lon) <= 540 && std::abs(places[i].lat) <= 90))
      return fail(Errc::invalid_argument,
                  fmt::format("{}: {},{} is no place of {}", named(i), points[i].x, points[i].y,
                              crs == "CRS84" ? "longitude,latitude (others: --places-crs)" : crs));
  return places;
}

Result<Geographic> read_place(const std::string& text, const char* option, const std::string& crs,
                              Geographic near) {
  const auto places = read_places(text, option, crs, near);
  if (!places) return std::unexpected(places.error());
  if (places->size() != 1)
    return fail(Errc::invalid_argument, fmt::format("{} takes one place, X,Y", option));
  return places->front();
}

}  // namespace tind::cli
