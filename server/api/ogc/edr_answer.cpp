#include "server/api/ogc/edr_answer.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "proto/text_put.h"
#include "server/api/crs_name.h"
#include "server/api/ogc/collection_json.h"
#include "terrain/geo/longitude.h"

namespace tind::api::ogc {
namespace {

using proto::text::put_text;

/// "[7,46", without its end.
void open_position(std::string& out, const Geographic& p) {
  out += '[';
  put_text(out, p.lon);
  out += ',';
  put_text(out, p.lat);
}

void put_points(std::string& out, const EdrPlaces& places, const EdrHeights& heights) {
  bool first = true;
  for (std::size_t i = 0; i < places.where.size(); ++i) {
    if (std::isnan(places.where[i].lon)) continue;
    if (!first) out += ",\n";
    first = false;
    out += R"({"type":"Feature","geometry":{"type":"Point","coordinates":)";
    open_position(out, places.where[i]);
    out += R"(]},"properties":{"height":)";
    if (std::isnan(heights.values[i]))
      out += "null";
    else
      put_text(out, heights.values[i]);
    out += "}}";
  }
}

struct LinePoint {
  Geographic place;
  double height;
};
using LinePart = std::vector<LinePoint>;

/// Cut where it crosses the antimeridian (RFC 7946, section 3.1.9), with a position on each side.
std::vector<LinePart> line_parts(std::span<const Geographic> places,
                                 std::span<const double> heights) {
  std::vector<LinePart> parts(1);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Geographic at = within_first_turn(places[i]);
    if (!parts.back().empty()) {
      const LinePoint last = parts.back().back();
      if (std::abs(at.lon - last.place.lon) > 180) {
        const double side = last.place.lon > 0 ? 180 : -180, to = at.lon + 2 * side;
        const double t = to == last.place.lon ? 0 : (side - last.place.lon) / (to - last.place.lon);
        const double lat = std::lerp(last.place.lat, at.lat, t);
        const double height = std::lerp(last.height, heights[i], t);
        parts.back().push_back({{side, lat}, height});
        parts.push_back({{{-side, lat}, height}});
      }
    }
    parts.back().push_back({at, heights[i]});
  }
  return parts;
}

void put_positions(std::string& out, const LinePart& part, bool with_heights) {
  const char* comma = "";
  out += '[';
  for (const LinePoint& p : part) {
    out += std::exchange(comma, ",");
    open_position(out, p.place);
    if (with_heights) {
      out += ',';
      put_text(out, p.height);
    }
    out += ']';
  }
  out += ']';
}

void put_heights(std::string& out, const LinePart& part) {
  const char* comma = "";
  out += '[';
  for (const LinePoint& p : part) {
    out += std::exchange(comma, ",");
    if (std::isnan(p.height))
      out += "null";
    else
      put_text(out, p.height);
  }
  out += ']';
}

/// put(part) of the only one, or of each in a list.
template <class Put>
void put_parts(std::string& out, const std::vector<LinePart>& parts, const Put& put) {
  if (parts.size() == 1) return put(parts[0]);
  const char* comma = "";
  out += '[';
  for (const LinePart& part : parts) {
    out += std::exchange(comma, ",");
    put(part);
  }
  out += ']';
}

void put_lines(std::string& out, const EdrPlaces& places, const EdrHeights& heights) {
  for (std::size_t n = 0; n < places.lines.size(); ++n) {
    const std::size_t begin = places.lines[n];
    const std::size_t end = n + 1 < places.lines.size() ? places.lines[n + 1] : places.where.size();
    const std::span<const double> own = std::span(heights.values).subspan(begin, end - begin);
    const auto parts = line_parts(std::span(places.where).subspan(begin, end - begin), own);
    // Readers take a position of two numbers among others of three for one of height 0: a line
    // with a void has its heights beside it.
    const bool whole = std::ranges::none_of(own, [](double h) { return std::isnan(h); });
    if (n > 0) out += ",\n";
    out += R"({"type":"Feature","geometry":{"type":")";
    out += parts.size() == 1 ? "LineString" : "MultiLineString";
    out += R"(","coordinates":)";
    put_parts(out, parts, [&](const LinePart& part) { put_positions(out, part, whole); });
    out += R"(},"properties":{)";
    if (!whole) {
      out += R"("height":)";
      put_parts(out, parts, [&](const LinePart& part) { put_heights(out, part); });
    }
    out += "}}";
  }
}

}  // namespace

std::string coverage_json_of(const EdrQuery& query, const AskedCrs& crs, const EdrPlaces& places,
                             const EdrHeights& heights) {
  proto::CoverageJson c;
  if (places.grid)
    c.x = places.x, c.y = places.y;
  else
    for (const Vec2& p : places.points) c.places.push_back({p.x, p.y});
  c.point = query.coords.type == proto::WktType::point && query.shape == EdrShape::position;
  c.crs = crs_uri(crs.name());
  c.geographic = crs.geographic();
  c.east_first = crs.east_first();
  c.parameter = height_parameter(heights.datum);
  c.values = heights.values;
  c.max_error_m = heights.max_error_m;
  c.off_m = heights.off_m;
  return proto::encode_coverage_json(c);
}

std::string geojson_of(const EdrQuery& query, const EdrPlaces& places, const EdrHeights& heights) {
  std::string out = R"({"type":"FeatureCollection","parameters":{"height":)" +
                    proto::encode_parameter(height_parameter(heights.datum)) + "}";
  if (heights.max_error_m) {
    out += R"(,"tind:max_error_m":)";
    put_text(out, *heights.max_error_m);
  }
  if (heights.off_m) {
    out += R"(,"tind:max_off_m":)";
    put_text(out, *heights.off_m);
  }
  out += R"(,"features":[)";
  if (query.shape == EdrShape::trajectory)
    put_lines(out, places, heights);
  else
    put_points(out, places, heights);
  return out + "]}\n";
}

}  // namespace tind::api::ogc
