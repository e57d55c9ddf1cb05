#include "terrain/store/build_record.h"

#include <limits>

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

/// Numbers that no int holds stay out.
void take(const Json& record, const char* key, int& to) {
  constexpr double kMost = std::numeric_limits<int>::max();
  to = int(json::number(record, key, -kMost, kMost).value_or(to));
}

}  // namespace

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
  j["gzip"] = r.gzip;
  if (r.exact_posts > 0) j["exact_posts"] = r.exact_posts;
  if (!r.tiles.empty()) j["tiles"] = r.tiles;
  if (!r.shapes.empty()) j["shapes"] = r.shapes;
  if (!r.shape_levels.empty()) j["shape_levels"] = r.shape_levels;
  // By level: a source with a larger range of heights can need coarser steps.
  for (const double step : r.steps_m) j["steps_m"].push_back(step);
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
  if (const Json gzip = j.value("gzip", Json()); gzip.is_boolean()) r.gzip = gzip;
  if (const Json posts = j.value("exact_posts", Json()); posts.is_number_integer())
    r.exact_posts = posts;
  take(j, "tiles", r.tiles);
  take(j, "shapes", r.shapes);
  take(j, "shape_levels", r.shape_levels);
  if (const Json steps = j.value("steps_m", Json()); steps.is_array())
    for (const Json& step : steps)
      r.steps_m.push_back(step.is_number() ? step.get<double>()
                                           : std::numeric_limits<double>::quiet_NaN());
  return r;
}

}  // namespace tind
