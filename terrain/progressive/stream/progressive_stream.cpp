// The order of the stream. Splits whose stars share no face commute: whichever goes first, the mesh
// between is made of faces that some state of the original order also had, so it is as valid and as
// exact. A split waits for the last one of its block that made or moved a face of its star; its
// generation is one more than the longest such chain.

#include "terrain/progressive/stream/progressive_stream.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "proto/stream/split_topology.h"

namespace tind {

namespace {

using Index = std::uint32_t;
using proto::LatticePoint;
using proto::SplitTopology;

// A block ends when the error has fallen to a share of what it is at its beginning,
constexpr std::size_t kFewest = 24;      // and it has this many splits,
constexpr std::size_t kShareOfMesh = 3;  // or is this share of all vertices so far

std::optional<LatticePoint> lattice_point(const Vec3& p, const Lattice& lattice) {
  const double x = p.x * lattice.per_post, y = p.y * lattice.per_post,
               z = std::nearbyint(p.z / lattice.z_step_m);
  const bool on = x == std::floor(x) && y == std::floor(y) && z * lattice.z_step_m == p.z &&
                  std::fabs(x) < 1 << 29 && std::fabs(y) < 1 << 29 && std::fabs(z) < 1 << 30;
  if (!on) return {};
  return LatticePoint{std::int32_t(x), std::int32_t(y), std::int32_t(z)};
}

std::size_t block_end(const ProgressiveMesh& pm, double share, std::size_t begin) {
  const double limit = share * pm.splits[begin].error_m;
  const std::size_t most = std::max(2 * kFewest, (pm.base.vertices.size() + begin) / kShareOfMesh);
  std::size_t end = begin;
  while (end < pm.splits.size() && end - begin < most &&
         (end - begin < kFewest || pm.splits[end].error_m >= limit))
    ++end;
  return end;
}

/// generation[i] of each split inside its block.
Result<std::vector<std::uint32_t>> generations(const ProgressiveMesh& pm, double share) {
  std::string problem;
  SplitTopology mesh(pm.base.triangles, pm.base.vertices.size(), pm.splits.size(), problem);
  if (!problem.empty()) return fail(Errc::bad_data, problem);
  constexpr std::size_t kNever = ~std::size_t(0);
  std::vector<std::size_t> changed(pm.base.triangles.size() + 2 * pm.splits.size(), kNever);
  std::vector<std::uint32_t> generation(pm.splits.size(), 0);
  SplitTopology::Fan fan;
  std::size_t begin = 0, end = 0;
  for (std::size_t i = 0; i < pm.splits.size(); ++i) {
    if (i == end) begin = i, end = block_end(pm, share, begin);
    const VertexSplit& s = pm.splits[i];
    mesh.fan(s.vertex, fan);
    for (const Index h : fan.edges)
      if (const std::size_t by = changed[h / 3]; by != kNever && by >= begin)
        generation[i] = std::max(generation[i], generation[by] + 1);
    const auto place = mesh.place(s.vertex, s.left, s.right);
    if (place.edge == SplitTopology::kNone)
      return fail(Errc::bad_data, "split " + std::to_string(i) + " is of no neighbours");
    mesh.split(place, s.right);
    for (const Index v : {s.vertex, Index(mesh.vertices() - 1)}) {
      mesh.fan(v, fan);
      for (const Index h : fan.edges) changed[h / 3] = i;
    }
  }
  return generation;
}

/// Splits in stream order with their new numbers, block by block.
struct Order {
  std::vector<VertexSplit> splits;
  std::vector<proto::StreamBlock> blocks;
};

Result<Order> stream_order(const ProgressiveMesh& pm, double share) {
  const auto generation = generations(pm, share);
  if (!generation) return std::unexpected(generation.error());
  const Index base = Index(pm.base.vertices.size());
  std::vector<Index> number(base + pm.splits.size());
  for (Index v = 0; v < base; ++v) number[v] = v;
  Order order;
  std::vector<std::size_t> block;
  for (std::size_t begin = 0; begin < pm.splits.size();) {
    const std::size_t end = block_end(pm, share, begin);
    block.clear();
    for (std::size_t i = begin; i < end; ++i) block.push_back(i);
    std::ranges::stable_sort(block, {}, [&](std::size_t i) { return (*generation)[i]; });
    for (auto from = block.begin(); from != block.end();) {
      const auto to = std::find_if(from, block.end(), [&](std::size_t i) {
        return (*generation)[i] != (*generation)[*from];
      });
      std::sort(from, to, [&](std::size_t i, std::size_t j) {
        return number[pm.splits[i].vertex] < number[pm.splits[j].vertex];
      });
      for (; from != to; ++from) {
        VertexSplit s = pm.splits[*from];
        number[base + *from] = Index(base + order.splits.size());
        s.vertex = number[s.vertex];
        s.left = number[s.left];
        if (s.right != VertexSplit::kNone) s.right = number[s.right];
        order.splits.push_back(s);
      }
    }
    order.blocks.push_back({std::uint32_t(end - begin), pm.splits[begin].error_m});
    begin = end;
  }
  return order;
}

std::optional<LatticePoint> lattice_point(const Vec3& p, const SpaceLattice& lattice) {
  const Vec3 x = lattice.whole(p);
  const double size = std::max({std::fabs(x.x), std::fabs(x.y), std::fabs(x.z)});
  if (!(size <= proto::kMostInSpace && lattice.place(x) == p)) return {};
  return LatticePoint{std::int32_t(x.x), std::int32_t(x.y), std::int32_t(x.z)};
}

/// Base, blocks and splits.
template <class AnyLattice>
Result<proto::MeshStream> stream_on(const ProgressiveMesh& pm, const AnyLattice& lattice,
                                    double share) {
  const Result<Order> order = stream_order(pm, share);
  if (!order) return std::unexpected(order.error());
  proto::MeshStream out;
  out.fine_error_m = pm.fine_error_m;
  bool on = true;
  const auto point = [&](const Vec3& p) {
    const auto q = lattice_point(p, lattice);
    on &= q.has_value();
    return q.value_or(LatticePoint{});
  };
  for (const Vec3& p : pm.base.vertices) out.base_vertices.push_back(point(p));
  out.base_triangles = pm.base.triangles;
  out.total_splits = std::uint32_t(order->splits.size());
  out.blocks = order->blocks;
  for (const VertexSplit& s : order->splits)
    out.splits.push_back({s.vertex, s.left, s.right, point(s.vertex_fine), point(s.added)});
  if (!on) {
    return fail(Errc::invalid_argument,
                "a position of the progressive mesh does not lie on the stream's lattice");
  }
  return out;
}

Vec3 position(const LatticePoint& p, const proto::MeshStream& s) {
  if (s.frame == proto::StreamFrame::space)
    return {(s.origin[0] + p[0]) / s.per_unit, (s.origin[1] + p[1]) / s.per_unit,
            (s.origin[2] + p[2]) / s.per_unit};
  return {p[0] / double(s.per_post), p[1] / double(s.per_post), p[2] * s.z_step_m};
}

/// The format has numbers for unknown, ellipsoid and egm96.
std::uint8_t datum_number(const VerticalDatum& datum) {
  return datum.kind() <= VerticalDatum::egm96 ? datum.kind() : VerticalDatum::unknown;
}

}  // namespace

Result<proto::MeshStream> to_stream(const ProgressiveMesh& pm, const Lattice& lattice,
                                    const DemInfo& info, double block_share) {
  if (!(lattice.z_step_m > 0))
    return fail(Errc::invalid_argument, "a stream needs a lattice with a step of height");
  auto out = stream_on(pm, lattice, block_share);
  if (!out) return out;
  out->per_post = std::uint16_t(lattice.per_post);
  out->z_step_m = lattice.z_step_m;
  out->cols = std::uint32_t(info.cols);
  out->rows = std::uint32_t(info.rows);
  const Affine& a = info.post_to_crs;
  out->post_to_crs = {a.x0, a.x_col, a.x_row, a.y0, a.y_col, a.y_row};
  out->z_unit_m = info.z_unit_m;
  out->datum = datum_number(info.datum);
  if (!info.crs_wkt.empty()) out->crs = info.crs_name + "\n" + info.crs_wkt;
  return out;
}

Result<proto::MeshStream> to_stream(const ProgressiveMesh& pm, const SpaceLattice& lattice) {
  auto out = stream_on(pm, lattice, kBlockShare);
  if (!out) return out;
  out->frame = proto::StreamFrame::space;
  out->per_unit = lattice.per_unit;
  out->origin = {lattice.origin.x, lattice.origin.y, lattice.origin.z};
  return out;
}

ProgressiveMesh from_stream(const proto::MeshStream& stream) {
  ProgressiveMesh pm;
  for (const LatticePoint& p : stream.base_vertices)
    pm.base.vertices.push_back(position(p, stream));
  pm.base.triangles = stream.base_triangles;
  std::vector<Vec3> now = pm.base.vertices;
  now.reserve(now.size() + stream.splits.size());
  pm.splits.reserve(stream.splits.size());
  std::size_t i = 0;
  for (const proto::StreamBlock& block : stream.blocks) {
    for (std::uint32_t k = 0; k < block.splits; ++k, ++i) {
      const proto::LatticeSplit& s = stream.splits[i];
      const Vec3 fine = position(s.fine, stream), added = position(s.added, stream);
      pm.splits.push_back({s.vertex, s.left, s.right, now[s.vertex], fine, added, block.error_m});
      now[s.vertex] = fine;
      now.push_back(added);
    }
  }
  const bool complete = stream.splits.size() == stream.total_splits;
  if (complete)
    pm.fine_error_m = stream.fine_error_m;
  else if (!stream.blocks.empty())
    pm.fine_error_m = stream.blocks.back().error_m;
  else
    pm.fine_error_m = HUGE_VAL;  // not one block's header has come
  return pm;
}

DemInfo info_of(const proto::MeshStream& stream) {
  DemInfo info;
  info.cols = stream.cols;
  info.rows = stream.rows;
  const auto& a = stream.post_to_crs;
  info.post_to_crs = {a[0], a[1], a[2], a[3], a[4], a[5]};
  info.has_geotransform = true;
  info.z_unit_m = stream.z_unit_m;
  info.datum = info.source_datum = VerticalDatum(VerticalDatum::Kind(stream.datum));
  const std::size_t line = stream.crs.find('\n');
  if (line != std::string::npos) {
    info.crs_name = stream.crs.substr(0, line);
    info.crs_wkt = stream.crs.substr(line + 1);
  }
  return info;
}

}  // namespace tind
