#include "server/api/ogc/edr_answer.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "proto/text_put.h"
#include "server/api/crs_name.h"
#include "server/api/ogc/collection_json.h"
#include "terrain/geo/line_parts.h"
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

void put_positions(std::string& out, const HeightLine& part, bool with_heights) {
  const char* comma = "";
  out += '[';
  for (const LinePoint& p : part) {
    out += std::exchange(comma, ",");
    open_position(out, p.place);
    if (with_heights) {
      out += ',';
      put_text(out, p.height_m);
    }
    out += ']';
  }
  out += ']';
}

void put_heights(std::string& out, const HeightLine& part) {
  const char* comma = "";
  out += '[';
  for (const LinePoint& p : part) {
    out += std::exchange(comma, ",");
    if (std::isnan(p.height_m))
      out += "null";
    else
      put_text(out, p.height_m);
  }
  out += ']';
}

/// put(part) of the only one, or of each in a list.
template <class Put>
void put_parts(std::string& out, const std::vector<HeightLine>& parts, const Put& put) {
  if (parts.size() == 1) return put(parts[0]);
  const char* comma = "";
  out += '[';
  for (const HeightLine& part : parts) {
    out += std::exchange(comma, ",");
    put(part);
  }
  out += ']';
}

void put_lines(std::string& out, const EdrPlaces& places, const EdrHeights& heights) {
  for (std::size_t n = 0; n < places.lines.size(); ++n) {
    const std::size_t begin = places.lines[n];
    const std::size_t end = n + 1 < places.lines.size() ? places.lines[n + 1] : places.where.size();
    std::vector<LinePoint> line;
    for (std::size_t i = begin; i < end; ++i)
      line.push_back({within_first_turn(places.where[i]), heights.values[i]});
    const auto parts = line_parts(line);
    const bool whole = has_all_heights(line);
    if (n > 0) out += ",\n";
    out += R"({"type":"Feature","geometry":{"type":")";
    out += parts.size() == 1 ? "LineString" : "MultiLineString";
    out += R"(","coordinates":)";
    put_parts(out, parts, [&](const HeightLine& part) { put_positions(out, part, whole); });
    out += R"(},"properties":{)";
    if (!whole) {
      out += R"("height":)";
      put_parts(out, parts, [&](const HeightLine& part) { put_heights(out, part); });
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
