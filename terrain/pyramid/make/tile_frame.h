#pragma once
// The rectangle of a tile before its posts are looked at: corners, borders, lines, what stands in
// for finer neighbours, and the lattice against the earth's curvature. Only tile_fit.cpp includes
// this.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <vector>

#include "terrain/base/power_of_two.h"
#include "terrain/mesh/halfedge_mesh.h"
#include "terrain/pyramid/make/kept_lines.h"
#include "terrain/pyramid/make/line_heights.h"
#include "terrain/pyramid/make/tile_job.h"
#include "terrain/shapes/surface_shapes.h"
#include "terrain/simplify/insertion/delaunay_insertion.h"
#include "terrain/simplify/insertion/line_points.h"

namespace tind {

/// The finest step with which the heights of borders and posts fit; borders stay on it, because
/// their step is a multiple.
inline HeightLattice height_lattice(const TileJob& job, double eps) {
  double low = HUGE_VAL, high = -HUGE_VAL;
  for (const auto& border : job.borders) {
    for (const BorderVertex& v : border)
      low = std::min(low, v.height), high = std::max(high, v.height);
  }
  for (const auto& line : job.stand_in)
    for (const Vec3& v : line) low = std::min(low, v.z), high = std::max(high, v.z);
  for (const TileLine& line : job.lines.lines)
    for (const Vec3& v : line.points)
      if (line.shore) low = std::min(low, v.z), high = std::max(high, v.z);
  if (job.posts.any()) {
    const double offset = job.level.offset_m;
    low = std::min(low, job.posts.min_m + std::min(0.0, offset) - eps);
    high = std::max(high, job.posts.max_m + std::max(0.0, offset) + eps);
  }
  low = std::max(low, job.level.lowest_m - 2 * eps);
  high = std::min(high, job.level.highest_m + 2 * eps);
  const double finest = std::max(power_of_two_at_least((high - low) / 32766),
                                 finest_step(std::max(std::abs(low), std::abs(high))));
  const double step = std::min(finest, job.steps.own);
  return {std::floor(low / step) * step, step};
}

/// The level of water where the lines of the tile say so, else z.
inline double level_by_lines(const TileJob& job, double u, double v, double z) {
  const std::uint32_t between = job.lines.between.holding(u, v);
  return between == AreaSet::kNone ? z : job.lines.level_between[between];
}

/// Makes the dataset's lines edges of the mesh that stay. All their points come first, so that no
/// flip for one of them undoes another.
template <class Insertion>
void keep_lines(const TileJob& job, const HeightLattice& lattice, HalfedgeMesh& mesh,
                Insertion& insertion, LinePoints& kept) {
  if (job.lines.lines.empty()) return;
  insertion.keep(&kept);
  std::vector<TileLine> lines = job.lines.lines;
  for (TileLine& line : lines)
    if (!line.shore) give_heights(job, line);
  // Where the two meet, the shore says how high.
  std::ranges::stable_partition(lines, [](const TileLine& line) { return !line.shore; });
  KeptLines keeper(mesh, insertion, kept);
  std::vector<std::vector<HalfedgeMesh::Index>> vertices;
  for (const TileLine& line : lines) {
    vertices.emplace_back();
    for (const Vec3& p : line.points) {
      const double h = std::clamp(p.z, lattice.min, lattice.max());
      vertices.back().push_back(keeper.vertex({p.x, p.y, snap_height(h, lattice.step)}));
    }
  }
  for (const auto& line : vertices)
    for (std::size_t i = 1; i < line.size(); ++i) keeper.join(line[i - 1], line[i]);
}

/// Makes the lines of job.stand_in, whose points are vertices, edges of the mesh that stay.
/// Vertices that lie on a line become part of it; where two that follow each other have no edge,
/// the line is halved until they do.
template <class Insertion>
void keep_stand_ins(const TileJob& job, double step, HalfedgeMesh& mesh, Insertion& insertion,
                    LinePoints& kept) {
  using Index = HalfedgeMesh::Index;
  insertion.keep(&kept);
  for (const auto& line : job.stand_in) {
    const bool northward = line.front().x == line.back().x;
    const auto along = [&](const Vec3& p) { return northward ? p.y : p.x; };
    const auto across = [&](const Vec3& p) { return northward ? p.x : p.y; };
    std::map<double, Index> on;  // the vertices on the line, by place
    for (Index v = 0; v < mesh.vertex_slots(); ++v) {
      const Vec3& p = mesh.position(v);
      if (across(p) == across(line.front()) && along(p) >= along(line.front()) &&
          along(p) <= along(line.back()))
        on[along(p)] = v;
    }
    auto a = on.begin();
    for (auto b = std::next(a); b != on.end(); b = std::next(a)) {
      if (mesh.find_edge(a->second, b->second) != HalfedgeMesh::kNone) {
        kept.add_edge(a->second, b->second);
        a = b;
        continue;
      }
      const Vec3 p = mesh.position(a->second), q = mesh.position(b->second);
      const double place = std::floor((a->first + b->first) / 2);
      const double share = (place - a->first) / (b->first - a->first);
      const double height = snap_height(p.z + share * (q.z - p.z), step);
      const Vec3 half = northward ? Vec3{p.x, place, height} : Vec3{place, p.y, height};
      if (!insertion.insert_point(half)) {  // no room: the line has a gap
        a = b;
        continue;
      }
      on[place] = Index(mesh.vertex_slots() - 1);
    }
  }
}

/// The rectangle with its borders and, on coarse levels, the lattice against the earth's curvature.
template <class Samples>
HalfedgeMesh frame_mesh(TileJob& job, const Samples& samples, double x_scale,
                        const HeightLattice& lattice, LinePoints& kept) {
  constexpr double kE = kTileExtent;
  const auto& [west, south, east, north] = job.borders;
  Tin corners;
  corners.vertices = {{0, 0, south.front().height},
                      {kE, 0, south.back().height},
                      {kE, kE, north.back().height},
                      {0, kE, north.front().height}};
  corners.triangles = {{0, 1, 2}, {0, 2, 3}};
  HalfedgeMesh mesh = *HalfedgeMesh::from_tin(corners);
  InsertionOptions o;
  o.x_scale = x_scale;
  DelaunayInsertion<Samples> insertion(mesh, samples, o);
  auto inner = [](const std::vector<BorderVertex>& line, auto&& place) {
    for (std::size_t i = 1; i + 1 < line.size(); ++i) place(line[i]);
  };
  inner(west, [&](const BorderVertex& v) { insertion.insert_point({0, double(v.t), v.height}); });
  inner(south, [&](const BorderVertex& v) { insertion.insert_point({double(v.t), 0, v.height}); });
  inner(east, [&](const BorderVertex& v) { insertion.insert_point({kE, double(v.t), v.height}); });
  inner(north, [&](const BorderVertex& v) { insertion.insert_point({double(v.t), kE, v.height}); });
  const auto insert = [&](const Vec3& p) {
    // What fills a void may come from a post that is not the tile's own.
    const double h = std::clamp(p.z, lattice.min, lattice.max());
    insertion.insert_point({p.x, p.y, snap_height(h, lattice.step)});
  };
  for (const auto& line : job.stand_in)
    for (const Vec3& p : line) insert({p.x, p.y, level_by_lines(job, p.x, p.y, p.z)});
  const int cells = job.level.curvature_cells;
  std::vector<Geographic> places;
  std::vector<Vec3> points;
  for (int j = 1; j < cells; ++j) {
    for (int i = 1; i < cells; ++i) {
      const double u = std::round(i * kE / cells), v = std::round(j * kE / cells);
      points.push_back({u, v, 0});
      places.push_back(
          {job.rect.west + u / kE * job.rect.width(), job.rect.south + v / kE * job.rect.height()});
    }
  }
  std::vector<double> heights(places.size());
  if (job.lattice)  // its nodes: posts would be a block of the source each
    std::ranges::transform(points, heights.begin(),
                           [&](const Vec3& p) { return job.lattice->nearest(p.x, p.y); });
  else
    job.field.filled(places, heights);
  for (std::size_t k = 0; k < points.size(); ++k) {
    points[k].z = heights[k] + job.level.offset_m;
    if (const SurfaceShapes* shapes = job.surface.shapes()) {
      if (const auto level = shapes->level_at(places[k]))
        points[k].z = line_scale(job.plan, job.id.level).level(*level);
      points[k].z = level_by_lines(job, points[k].x, points[k].y, points[k].z);
    }
    insert(points[k]);
  }
  keep_lines(job, lattice, mesh, insertion, kept);
  keep_stand_ins(job, lattice.step, mesh, insertion, kept);
  return mesh;
}

}  // namespace tind
