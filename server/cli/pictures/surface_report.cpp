#include "server/cli/pictures/surface_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "terrain/base/result.h"
#include "terrain/raster/height_grid.h"
#include "terrain/simplify/collapse/attribute_quadric.h"

namespace tind::cli {

namespace {

nlohmann::ordered_json side(const OneSidedDistance& d) {
  return {{"max", d.max},
          {"rms", d.rms},
          {"mean", d.mean},
          {"samples", d.samples},
          {"samples_left_out", d.left_out}};
}

}  // namespace

nlohmann::ordered_json distance_json(const SurfaceDistance& d) {
  nlohmann::ordered_json j = {{"distance_max", d.max},
                              {"distance_rms", d.rms},
                              {"diagonal", d.diagonal},
                              {"a_to_b", side(d.a_to_b)},
                              {"b_to_a", side(d.b_to_a)}};
  auto add = [&](const char* name, const std::optional<AttributeError>& e) {
    if (e) j[name] = {{"rms", e->rms}, {"max", e->max}};
  };
  add("colour_error", d.colour);
  add("normal_error", d.normal);
  add("texture_error", d.texture);
  return j;
}

std::optional<SurfaceDistance> attribute_errors(const SimplifyOptions& options, const Terrain& dem,
                                                const Tin& made) {
  const auto* const method = std::get_if<AttributeQemOptions>(&options.method);
  if (!method) return {};
  const Result<Tin> full = terrain_with_attributes(dem, *method, options.constraints.get());
  if (!full) return {};
  Tin metric = made;
  for (Vec3& v : metric.vertices) v.x *= dem.spacing_x_m, v.y *= dem.spacing_y_m;
  return surface_distance(*full, metric, {.face_samples = 300000, .threads = options.threads});
}

std::string distance_text(const SurfaceDistance& d) {
  std::string out = fmt::format("surface distance: max {:.6g}, rms {:.6g}", d.max, d.rms);
  if (d.diagonal > 0)
    out += fmt::format(" ({:.4f} % and {:.4f} % of the diagonal {:.6g})", 100 * d.max / d.diagonal,
                       100 * d.rms / d.diagonal, d.diagonal);
  out += '\n';
  auto line = [&](const char* name, const std::optional<AttributeError>& e) {
    if (e) out += fmt::format("{} error: rms {:.4f}, max {:.4f}\n", name, e->rms, e->max);
  };
  line("colour", d.colour);
  line("normal", d.normal);
  line("texture", d.texture);
  const std::uint64_t measured = d.a_to_b.samples + d.b_to_a.samples;
  const std::uint64_t left_out = d.a_to_b.left_out + d.b_to_a.left_out;
  if (left_out > 0)
    out += fmt::format(
        "measured at {} of {} samples: the triangles go through each other every way (are the "
        "corners' numbers right?), and all would take too long\n",
        measured, measured + left_out);
  return out;
}

}  // namespace tind::cli
