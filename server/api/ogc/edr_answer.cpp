#include "server/api/ogc/edr_answer.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "proto/text_put.h"
#include "server/api/crs_name.h"
#include "server/api/ogc/collection_json.h"

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

void put_lines(std::string& out, const EdrPlaces& places, const EdrHeights& heights) {
  for (std::size_t n = 0; n < places.lines.size(); ++n) {
    const std::size_t begin = places.lines[n];
    const std::size_t end = n + 1 < places.lines.size() ? places.lines[n + 1] : places.where.size();
    // Readers take a position of two numbers among others of three for one of height 0: a line
    // with a void has its heights beside it.
    const bool whole = std::none_of(heights.values.begin() + std::ptrdiff_t(begin),
                                    heights.values.begin() + std::ptrdiff_t(end),
                                    [](double h) { return std::isnan(h); });
    if (n > 0) out += ",\n";
    out += R"({"type":"Feature","geometry":{"type":"LineString","coordinates":[)";
    for (std::size_t i = begin; i < end; ++i) {
      if (i > begin) out += ',';
      open_position(out, places.where[i]);
      if (whole) {
        out += ',';
        put_text(out, heights.values[i]);
      }
      out += ']';
    }
    out += R"(]},"properties":{)";
    if (!whole) {
      out += R"("height":[)";
      for (std::size_t i = begin; i < end; ++i) {
        if (i > begin) out += ',';
        if (std::isnan(heights.values[i]))
          out += "null";
        else
          put_text(out, heights.values[i]);
      }
      out += ']';
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
