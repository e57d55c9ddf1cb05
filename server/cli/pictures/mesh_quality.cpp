#include "server/cli/pictures/mesh_quality.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "server/api/accuracy_json.h"
#include "terrain/mesh/validity.h"

namespace tind::cli {

namespace {

/// What the mesh alone says.
MeshQuality validity_of(const Tin& mesh) {
  MeshQuality q;
  q.triangles = mesh.triangles.size();
  q.vertices = mesh.vertices.size();
  const MeshValidity validity = check_validity(mesh);
  q.flipped = validity.flipped;
  q.non_manifold = validity.non_manifold;
  return q;
}

/// How far coordinates as a file holds them may lie beside their posts. Doubles of some
/// millions of metres end a nanometre on: with posts centimetres apart that is more than
/// scan_triangle forgives.
double slack_posts(const Tin& mesh, const MeshMap& map, bool float_file, int cols, int rows) {
  constexpr double kForgiven = 1e-8, kMost = 1e-3;  // posts
  if (float_file) return std::max(cols, rows) * 0x1p-23;
  double largest = 0;
  for (const Vec3& v : mesh.vertices) largest = std::max({largest, std::fabs(v.x), std::fabs(v.y)});
  const double step =
      std::min(std::hypot(map.xy.x_col, map.xy.y_col), std::hypot(map.xy.x_row, map.xy.y_row));
  const double slack = largest * 0x1p-51 / step;  // there and back round four times
  return slack > kForgiven ? std::min(slack, kMost) : 0;
}

}  // namespace

Result<MeshQuality> mesh_quality_in_strips(const Tin& mesh, const MeshMap& map, int cols, int rows,
                                           const ReadStrip& read, int threads, bool float_file) {
  MeshQuality q = validity_of(mesh);
  const auto error = vertical_error_in_strips(map.to_posts(mesh), cols, rows, read, threads,
                                              slack_posts(mesh, map, float_file, cols, rows));
  if (!error) return std::unexpected(error.error());
  q.error = *error;
  q.uncovered = q.error.uncovered;
  return q;
}

std::uint64_t isolated_posts(const HeightGrid& grid) {
  const auto valid = [&](int c, int r) { return grid.inside(c, r) && !grid.is_void(c, r); };
  std::uint64_t isolated = 0;
  for (int r = 0; r < grid.rows(); ++r) {
    for (int c = 0; c < grid.cols(); ++c) {
      if (grid.is_void(c, r)) continue;
      bool held = false;
      for (const int dc : {-1, 1})
        for (const int dr : {-1, 1})
          held |= valid(c + dc, r) + valid(c, r + dr) + valid(c + dc, r + dr) >= 2;
      isolated += !held;
    }
  }
  return isolated;
}

MeshQuality mesh_quality(const Tin& mesh, const MeshMap& map, const HeightGrid& posts, int threads,
                         bool float_file) {
  MeshQuality q = validity_of(mesh);
  const Tin on_posts = map.to_posts(mesh);
  q.error = vertical_error(on_posts, posts, threads,
                           slack_posts(mesh, map, float_file, posts.cols(), posts.rows()));
  q.surface = surface_error(on_posts, posts, q.error, threads);
  if (q.error.uncovered > 0) q.isolated = std::min(q.error.uncovered, isolated_posts(posts));
  q.uncovered = q.error.uncovered;
  return q;
}

void widen(MeshQuality& q, double rounding_m) {
  q.error = widened(q.error, rounding_m);
  if (!q.surface || rounding_m == 0) return;
  q.surface->max_above_m += rounding_m, q.surface->max_below_m += rounding_m;
}

MeshQuality tin_quality(const Tin& mesh, const TerrainTin& of, int threads, bool float_file) {
  MeshQuality q = validity_of(mesh);
  double slack = 0;
  if (float_file) {
    const auto [west, east] = std::ranges::minmax(of.tin.vertices, {}, &Vec3::x);
    const auto [south, north] = std::ranges::minmax(of.tin.vertices, {}, &Vec3::y);
    slack = std::max(east.x - west.x, north.y - south.y) * 0x1p-20;  // stl_origin
  }
  q.error = vertical_error(mesh, of.tin.vertices, of.z_unit_m, threads, slack);
  q.uncovered = q.error.uncovered;
  return q;
}

VolumeBetween volume_between(const VerticalError& e, const DemInfo& info) {
  constexpr double kRadian = 3.14159265358979323846 / 180;
  const double middle_col = double(info.cols - 1) / 2, middle_row = double(info.rows - 1) / 2;
  const double step = std::hypot(info.post_to_crs.x_col, info.post_to_crs.y_col);
  const bool degrees = info.crs_kind == CrsKind::geographic && info.period_cols > 0 && step > 0;
  const auto cosine = [&](double row) {  // the CRS may count in other units than degrees
    const double y = info.post_to_crs.apply(middle_col, row).y;
    return std::cos(y * 360 / (info.period_cols * step) * kRadian);
  };
  VolumeBetween v;
  for (std::size_t row = 0; row < e.row_above_m.size(); ++row) {
    double area = info.spacing_x_m * info.spacing_y_m;
    if (degrees) area *= std::max(0.0, cosine(double(row))) / std::max(1e-9, cosine(middle_row));
    v.above_m3 += area * e.row_above_m[row];
    v.below_m3 += area * e.row_below_m[row];
  }
  return v;
}

namespace {

/// What holds over posts and over vertices alike.
nlohmann::ordered_json figures_json(const MeshQuality& q) {
  const VerticalError& e = q.error;
  return {{"triangles", q.triangles},
          {"vertices", q.vertices},
          {"max_error_m", e.max_m},
          {"rms_error_m", e.rms_m},
          {"mean_error_m", e.mean_m},
          {"p50_m", e.p50_m},
          {"p95_m", e.p95_m},
          {"p99_m", e.p99_m},
          {"max_above_m", e.max_above_m},
          {"max_below_m", e.max_below_m}};
}

}  // namespace

nlohmann::ordered_json tin_quality_json(const MeshQuality& q) {
  const VerticalError& e = q.error;
  nlohmann::ordered_json j = figures_json(q);
  j["max_at"] = {{"x", e.max_at.x}, {"y", e.max_at.y}, {"z", e.max_at.z}};
  j["bias_m"] = e.bias_m;
  j["vertices_measured"] = e.posts;
  j["flipped"] = q.flipped;
  j["non_manifold"] = q.non_manifold;
  j["vertices_uncovered"] = q.uncovered;
  return j;
}

std::string tin_quality_text(const MeshQuality& q) {
  const VerticalError& e = q.error;
  return fmt::format(
      "{} triangles, {} vertices; {} flipped, {} vertices of the TIN uncovered\n"
      "vertical error over {} vertices of the TIN: max {:.3f} m (at x {:.10g}, y {:.10g}), RMS "
      "{:.3f} m, mean {:.3f} m, 50/95/99 % below {:.3f}/{:.3f}/{:.3f} m; mesh - TIN {:+.3f} m in "
      "the mean\n",
      q.triangles, q.vertices, q.flipped, q.uncovered, e.posts, e.max_m, e.max_at.x, e.max_at.y,
      e.rms_m, e.mean_m, e.p50_m, e.p95_m, e.p99_m, e.bias_m);
}

nlohmann::ordered_json quality_json(const MeshQuality& q) {
  const VerticalError& e = q.error;
  nlohmann::ordered_json surface, surface_at;
  if (q.surface) {
    surface = q.surface->max_m();
    surface_at = {{"col", q.surface->at.x}, {"row", q.surface->at.y}};
  }
  nlohmann::ordered_json j = figures_json(q);
  j["max_at"] = {{"col", e.max_col}, {"row", e.max_row}};
  j["max_surface_error_m"] = std::move(surface);
  j["max_surface_error_at"] = std::move(surface_at);
  j["bias_m"] = e.bias_m;
  j["posts"] = e.posts;
  j["flipped"] = q.flipped;
  j["non_manifold"] = q.non_manifold;
  j["posts_uncovered"] = q.uncovered;
  j["posts_isolated"] = q.isolated;
  return j;
}

nlohmann::ordered_json ground_json(const MeshQuality& q, const DemInfo& info, int epsg) {
  const VolumeBetween v = volume_between(q.error, info);
  const std::uint64_t all = std::uint64_t(info.cols) * std::uint64_t(info.rows);
  nlohmann::ordered_json j = {
      {"volume_m3",
       {{"net", v.above_m3 - v.below_m3}, {"above", v.above_m3}, {"below", v.below_m3}}},
      {"posts_void", all - q.error.posts - q.uncovered},
      {"crs", info.crs_name}};
  j["epsg"] = epsg > 0 ? nlohmann::ordered_json(epsg) : nullptr;
  j["crs_wkt"] = info.crs_wkt;
  j["vertical_datum"] = name(info.datum);
  if (info.accuracy) j["accuracy"] = api::accuracy_json(*info.accuracy);
  return j;
}

std::string quality_text(const MeshQuality& q) {
  const VerticalError& e = q.error;
  std::string text = fmt::format(
      "{} triangles, {} vertices; {} flipped, {} posts uncovered\n"
      "vertical error over {} posts: max {:.3f} m (at column {}, row {}), RMS {:.3f} m, "
      "mean {:.3f} m, 50/95/99 % below {:.3f}/{:.3f}/{:.3f} m; mesh - post {:+.3f} m in the mean\n",
      q.triangles, q.vertices, q.flipped, q.uncovered, e.posts, e.max_m, e.max_col, e.max_row,
      e.rms_m, e.mean_m, e.p50_m, e.p95_m, e.p99_m, e.bias_m);
  if (q.surface)
    text += fmt::format("between the posts, against the bilinear surface: max {:.3f} m\n",
                        q.surface->max_m());
  if (q.uncovered > 0) {
    text += fmt::format(
        "{} valid posts ({:.3g} %) are in no triangle, and the error does not count them: {} of "
        "them "
        "have no cell with three valid corners beside them\n",
        q.uncovered, 100.0 * double(q.uncovered) / double(q.uncovered + e.posts), q.isolated);
  }
  return text;
}

}  // namespace tind::cli
