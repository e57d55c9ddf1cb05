#include "terrain/store/build_record.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "proto/json_member.h"
#include "proto/json_text.h"

namespace tind {

namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 3;  // of the record; from 3 on there is a ledger

void take(const Json& record, const char* key, double& to) {
  to = json::number(record, key).value_or(to);
}

void take(const Json& record, const char* key, std::string& to) {
  to = json::text(record, key).value_or(to);
}

void take(const Json& record, const char* key, bool& to) {
  if (const Json value = record.value(key, Json()); value.is_boolean()) to = value;
}

void take(const Json& record, const char* key, std::int64_t& to) {
  if (const Json value = record.value(key, Json()); value.is_number_integer()) to = value;
}

/// Numbers that no int holds stay out.
void take(const Json& record, const char* key, int& to) {
  constexpr double kMost = std::numeric_limits<int>::max();
  to = int(json::number(record, key, -kMost, kMost).value_or(to));
}

template <std::size_t N>
std::optional<std::array<double, N>> numbers(const Json& j) {
  std::array<double, N> out{};
  if (!j.is_array() || j.size() != N) return {};
  for (std::size_t i = 0; i < N; ++i) {
    if (!j[i].is_number()) return {};
    out[i] = j[i].get<double>();
  }
  return out;
}

std::array<double, 4> numbers_of(const GeoRect& r) { return {r.west, r.south, r.east, r.north}; }

std::optional<GeoRect> rect_of(const Json& j) {
  const auto n = numbers<4>(j);
  if (!n) return {};
  return GeoRect{(*n)[0], (*n)[1], (*n)[2], (*n)[3]};
}

Json to_json(const LayerRecord& l) {
  Json j;
  const Affine& a = l.post_to_crs;
  j["crs"] = l.crs;
  j["post_to_crs"] = {a.x0, a.x_col, a.x_row, a.y0, a.y_col, a.y_row};
  j["posts"] = {l.cols, l.rows};
  j["files"] = l.files;
  j["plain"] = l.plain;
  j["wraps"] = l.wraps;
  j["period_cols"] = l.period_cols;
  j["spacing_m"] = {l.spacing_x_m, l.spacing_y_m};
  j["rounding_m"] = l.rounding_m;
  j["blend_m"] = l.blend_m;
  if (l.max_error_m > 0) j["max_error_m"] = l.max_error_m;
  j["bounds"] = numbers_of(l.bounds);
  for (const GeoRect& r : l.extents) j["extents"].push_back(numbers_of(r));
  return j;
}

std::optional<LayerRecord> layer_of(const Json& j) {
  if (!j.is_object()) return {};
  LayerRecord l;
  const auto affine = numbers<6>(j.value("post_to_crs", Json()));
  const auto spacing = numbers<2>(j.value("spacing_m", Json()));
  const auto bounds = rect_of(j.value("bounds", Json()));
  const Json posts = j.value("posts", Json());
  if (!affine || !spacing || !bounds || !posts.is_array() || posts.size() != 2) return {};
  for (const Json& n : posts)
    if (!n.is_number_integer() || n.get<std::int64_t>() < 1) return {};
  take(j, "crs", l.crs);
  l.post_to_crs = {(*affine)[0], (*affine)[1], (*affine)[2],
                   (*affine)[3], (*affine)[4], (*affine)[5]};
  l.cols = posts[0], l.rows = posts[1];
  take(j, "files", l.files);
  take(j, "plain", l.plain);
  take(j, "wraps", l.wraps);
  take(j, "period_cols", l.period_cols);
  l.spacing_x_m = (*spacing)[0], l.spacing_y_m = (*spacing)[1];
  take(j, "rounding_m", l.rounding_m);
  take(j, "blend_m", l.blend_m);
  take(j, "max_error_m", l.max_error_m);
  l.bounds = *bounds;
  for (const Json& r : j.value("extents", Json::array())) {
    const auto rect = rect_of(r);
    if (!rect) return {};
    l.extents.push_back(*rect);
  }
  return l;
}

/// What of the record is there to be told from, and says nothing of its own of the bytes.
void take_surface(const Json& j, BuildRecord& r) {
  for (const Json& layer : j.value("layers", Json::array())) {
    auto one = layer_of(layer);
    if (!one) return r.layers.clear();
    r.layers.push_back(std::move(*one));
  }
  if (const auto range = numbers<2>(j.value("range_m", Json())))
    r.range_m = {(*range)[0], (*range)[1]};
  for (const Json& level : j.value("level_ranges_m", Json::array()))
    if (const auto range = numbers<2>(level))
      r.level_ranges_m.emplace_back((*range)[0], (*range)[1]);
}

}  // namespace

bool LayerRecord::continues(const LayerRecord& other) const {
  constexpr double kSameStep = 1e-6, kWholePost = 0.01;
  const Affine &a = post_to_crs, &b = other.post_to_crs;
  const double step = std::max({std::abs(a.x_col), std::abs(a.x_row), std::abs(a.y_row)});
  const auto close = [&](double p, double q) { return std::abs(p - q) <= kSameStep * step; };
  if (crs != other.crs || !close(a.x_col, b.x_col) || !close(a.x_row, b.x_row) ||
      !close(a.y_col, b.y_col) || !close(a.y_row, b.y_row))
    return false;
  const Vec2 corner = a.invert(b.x0, b.y0);
  return std::abs(corner.x - std::round(corner.x)) <= kWholePost &&
         std::abs(corner.y - std::round(corner.y)) <= kWholePost;
}

bool LayerRecord::meets(const LayerRecord& o) const {
  const auto own = extents.empty() ? std::vector{bounds} : extents;
  const auto others = o.extents.empty() ? std::vector{o.bounds} : o.extents;
  return std::ranges::any_of(own, [&](const GeoRect& a) {
    return std::ranges::any_of(others, [&](const GeoRect& b) { return a.overlaps(b); });
  });
}

bool LayerRecord::same_lattice(const LayerRecord& o) const {
  return crs == o.crs && post_to_crs == o.post_to_crs && plain == o.plain && wraps == o.wraps &&
         period_cols == o.period_cols && rounding_m == o.rounding_m;
}

bool may_update(const BuildRecord& a, const BuildRecord& b) {
  const auto alike = [](const BuildRecord& r) {
    return std::tie(r.epoch, r.max_error_m, r.error_factor, r.side, r.vertical_datum, r.effort,
                    r.method, r.gzip, r.exact_posts, r.shapes);
  };
  if (alike(a) != alike(b)) return false;
  if (a.layer_epoch > 0 && b.layer_epoch > 0 && a.layer_epoch != b.layer_epoch) return false;
  const auto tiles = [](const BuildRecord& r) {
    return std::tie(r.grid, r.deepest_level, r.first_level, r.last_level, r.tiles);
  };
  if (a.layers.empty() || b.layers.empty()) return tiles(a) == tiles(b);
  // All levels down to wherever the posts end, or the same ones.
  const auto whole = [](const BuildRecord& r) { return r.last_level == r.deepest_level; };
  if (a.asked_deepest != b.asked_deepest || a.first_level != b.first_level ||
      (a.last_level != b.last_level && !(whole(a) && whole(b))))
    return false;
  return std::ranges::any_of(a.layers, [&](const LayerRecord& layer) {
    return std::ranges::any_of(b.layers, [&](const LayerRecord& other) {
      return layer.continues(other) && layer.meets(other);
    });
  });
}

std::string encode(const BuildRecord& r) {
  Json j;
  j["made_by"] = "tind build";
  j["format"] = kFormat;
  j["epoch"] = r.epoch;
  j["grid"] = r.grid;
  j["heights"] = r.heights;
  j["max_error_m"] = r.max_error_m;
  j["error_factor"] = r.error_factor;
  j["deepest_level"] = r.deepest_level;
  j["levels"] = {r.first_level, r.last_level};
  j["side"] = r.side;
  j["vertical_datum"] = r.vertical_datum;  // for people; the grid has it, too
  j["effort"] = r.effort;
  if (!r.method.empty()) j["method"] = r.method;
  if (!r.drape.empty()) j["drape"] = r.drape;
  j["gzip"] = r.gzip;
  if (r.exact_posts > 0) j["exact_posts"] = r.exact_posts;
  if (!r.tiles.empty()) j["tiles"] = r.tiles;
  if (!r.shapes.empty()) j["shapes"] = r.shapes;
  if (!r.shape_levels.empty()) j["shape_levels"] = r.shape_levels;
  // By level: a source with a larger range of heights can need coarser steps.
  for (const double step : r.steps_m) j["steps_m"].push_back(step);
  if (r.layer_epoch > 0) j["layer_epoch"] = r.layer_epoch;
  if (r.asked_deepest >= 0) j["asked_deepest"] = r.asked_deepest;
  if (!r.layers.empty()) j["range_m"] = {r.range_m.first, r.range_m.second};
  for (const auto& [low, high] : r.level_ranges_m) j["level_ranges_m"].push_back({low, high});
  for (const LayerRecord& layer : r.layers) j["layers"].push_back(to_json(layer));
  return j.dump(1) + "\n";
}

std::optional<BuildRecord> decode_build_record(std::string_view text) {
  const Json j = json::parse<Json>(text);
  if (!j.is_object()) return {};
  BuildRecord r;
  take(j, "epoch", r.epoch);
  take(j, "grid", r.grid);
  take(j, "heights", r.heights);
  take(j, "max_error_m", r.max_error_m);
  take(j, "error_factor", r.error_factor);
  take(j, "deepest_level", r.deepest_level);
  if (const Json levels = j.value("levels", Json()); levels.is_array() && levels.size() == 2) {
    if (levels[0].is_number_integer()) r.first_level = levels[0];
    if (levels[1].is_number_integer()) r.last_level = levels[1];
  }
  take(j, "side", r.side);
  take(j, "vertical_datum", r.vertical_datum);
  take(j, "effort", r.effort);
  take(j, "method", r.method);
  take(j, "drape", r.drape);
  take(j, "gzip", r.gzip);
  take(j, "exact_posts", r.exact_posts);
  take(j, "layer_epoch", r.layer_epoch);
  take(j, "asked_deepest", r.asked_deepest);
  take(j, "tiles", r.tiles);
  take(j, "shapes", r.shapes);
  take(j, "shape_levels", r.shape_levels);
  if (const Json steps = j.value("steps_m", Json()); steps.is_array())
    for (const Json& step : steps)
      r.steps_m.push_back(step.is_number() ? step.get<double>()
                                           : std::numeric_limits<double>::quiet_NaN());
  take_surface(j, r);
  return r;
}

}  // namespace tind
