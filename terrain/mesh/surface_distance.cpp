#include "terrain/mesh/surface_distance.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>

#include "terrain/base/parallel.h"
#include "terrain/mesh/nearest.h"

namespace tind {

namespace {

constexpr std::size_t kBlock = 4096;   // samples per unit of parallel work
constexpr std::size_t kFewBlock = 64;  // of those that are hard to measure
constexpr double kFewLooks = 200;      // at triangles that a search may take in any mesh

struct Sample {
  std::uint32_t triangle;
  Vec3 weights;  // barycentric
  bool on_face;
};

/// Spreads `count` points over items in proportion to their sizes: calls f(item, k) for the k-th
/// point of all, in order.
template <class F>
void spread(const std::vector<double>& sizes, std::uint64_t count, F&& f) {
  double total = 0;
  for (const double s : sizes) total += s;
  if (!(total > 0)) return;
  double reached = 0;
  std::uint64_t k = 0;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    reached += sizes[i];
    for (const double end = reached / total * double(count); double(k) + 0.5 < end; ++k) f(i, k);
  }
}

Vec3 corner(int k) { return {double(k == 0), double(k == 1), double(k == 2)}; }

/// Samples of a mesh: each vertex once, then edges by length, then faces by area. The points follow
/// the additive recurrence of Roberts (R2), which fills a triangle evenly at any count.
std::vector<Sample> samples_of(const Tin& tin, std::uint64_t face_samples) {
  std::vector<Sample> samples;
  std::vector<std::uint8_t> seen(tin.vertices.size(), 0);
  std::vector<double> areas, lengths;
  for (std::uint32_t t = 0; t < tin.triangles.size(); ++t) {
    const Triangle& c = tin.triangles[t];
    for (int k = 0; k < 3; ++k) {
      if (!seen[c[k]]) samples.push_back({t, corner(k), false});
      seen[c[k]] = 1;
      const Vec3 &a = tin.vertices[c[k]], &b = tin.vertices[c[(k + 1) % 3]];
      // An inner edge is met twice; its first triangle has it.
      lengths.push_back(c[k] < c[(k + 1) % 3] ? length(b - a) : 0);
    }
    const Vec3 &a = tin.vertices[c[0]], &b = tin.vertices[c[1]], &d = tin.vertices[c[2]];
    areas.push_back(length(cross(b - a, d - a)) / 2);
  }
  spread(lengths, face_samples / 4, [&](std::size_t edge, std::uint64_t k) {
    const int from = int(edge % 3);
    const double s = std::fmod(0.5 + double(k) * 0.6180339887498949, 1.0);
    samples.push_back(
        {std::uint32_t(edge / 3), corner(from) * (1 - s) + corner((from + 1) % 3) * s, false});
  });
  spread(areas, face_samples, [&](std::size_t t, std::uint64_t k) {
    double u = std::fmod(0.5 + double(k) * 0.7548776662466927, 1.0);
    double v = std::fmod(0.5 + double(k) * 0.5698402909980532, 1.0);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    samples.push_back({std::uint32_t(t), {1 - u - v, u, v}, true});
  });
  return samples;
}

template <class T, std::size_t N>
std::array<double, N> interpolate(const std::vector<std::array<T, N>>& values, const Triangle& t,
                                  const Vec3& w) {
  std::array<double, N> out{};
  for (std::size_t i = 0; i < N; ++i)
    out[i] = w.x * values[t[0]][i] + w.y * values[t[1]][i] + w.z * values[t[2]][i];
  return out;
}

/// Sums of one block of samples, and of all.
struct Sums {
  double max2 = 0, sum = 0, sum2 = 0;
  std::uint64_t faces = 0, samples = 0, left_out = 0;
  struct Attribute {
    double max2 = 0, sum2 = 0;
    std::uint64_t faces = 0;

    void add(double squared, bool on_face) {
      max2 = std::max(max2, squared);
      if (on_face) sum2 += squared, ++faces;
    }
    void add(const Attribute& o) {
      max2 = std::max(max2, o.max2);
      sum2 += o.sum2;
      faces += o.faces;
    }
    AttributeError error() const {
      return {std::sqrt(max2), faces > 0 ? std::sqrt(sum2 / double(faces)) : 0};
    }
  } colour, normal, texture;

  void add(const Sums& o) {
    max2 = std::max(max2, o.max2);
    sum += o.sum, sum2 += o.sum2;
    faces += o.faces, samples += o.samples;
    colour.add(o.colour), normal.add(o.normal), texture.add(o.texture);
  }
};

template <class T, std::size_t N>
void compare(const std::vector<std::array<T, N>>& a, const Triangle& ta, const Vec3& wa,
             const std::vector<std::array<T, N>>& b, const Triangle& tb, const Vec3& wb,
             bool unit_length, bool on_face, Sums::Attribute& out) {
  if (a.empty() || b.empty()) return;
  std::array<double, N> x = interpolate(a, ta, wa), y = interpolate(b, tb, wb);
  if (unit_length) {
    for (auto* v : {&x, &y}) {
      double l = 0;
      for (const double c : *v) l += c * c;
      if (l > 0)
        for (double& c : *v) c /= std::sqrt(l);
    }
  }
  double squared = 0;
  for (std::size_t i = 0; i < N; ++i) squared += (x[i] - y[i]) * (x[i] - y[i]);
  out.add(squared, on_face);
}

Vec3 place_of(const Sample& s, const Tin& tin) {
  const Triangle& t = tin.triangles[s.triangle];
  return tin.vertices[t[0]] * s.weights.x + tin.vertices[t[1]] * s.weights.y +
         tin.vertices[t[2]] * s.weights.z;
}

/// Every how many-th sample is to be measured, by what some of them cost.
std::size_t stride_of(const std::vector<Sample>& samples, const Tin& from,
                      const NearestTriangle& nearest, double most_looks) {
  constexpr std::size_t kTried = 128;
  double looked_at = 0;
  for (std::size_t k = 0; k < kTried && !samples.empty(); ++k) {
    const std::size_t one = k * samples.size() / kTried;
    looked_at += nearest.find(place_of(samples[one], from)).looked_at;
  }
  const double all = looked_at / kTried * double(samples.size());
  const double may = std::max(most_looks, kFewLooks * double(samples.size()));
  return std::size_t(std::max(1.0, std::ceil(all / may)));
}

Sums measure(const Tin& from, const Tin& to, std::uint64_t face_samples, const SurfaceSampling& how,
             const Progress& progress) {
  std::vector<Sample> samples = samples_of(from, face_samples);
  const NearestTriangle nearest(to);
  const std::size_t stride = stride_of(samples, from, nearest, how.most_looks),
                    all = samples.size();
  for (std::size_t i = 0; i < all; i += stride) samples[i / stride] = samples[i];
  samples.resize((all + stride - 1) / stride);
  const std::size_t per_block = stride > 1 ? kFewBlock : kBlock;
  std::vector<Sums> blocks((samples.size() + per_block - 1) / per_block);
  std::atomic<std::size_t> done = 0;
  parallel_for(blocks.size(), how.threads, [&](std::size_t block) {
    Sums& sums = blocks[block];
    std::uint32_t hint = 0;
    for (std::size_t i = block * per_block; i < std::min(samples.size(), (block + 1) * per_block);
         ++i) {
      const Sample& s = samples[i];
      const Triangle& t = from.triangles[s.triangle];
      const NearestPoint n = nearest.find(place_of(s, from), hint);
      hint = n.triangle;
      sums.max2 = std::max(sums.max2, n.squared);
      ++sums.samples;
      if (s.on_face) {
        ++sums.faces;
        sums.sum += std::sqrt(n.squared);
        sums.sum2 += n.squared;
      }
      const Triangle& u = to.triangles[n.triangle];
      compare(from.colours, t, s.weights, to.colours, u, n.weights, false, s.on_face, sums.colour);
      compare(from.normals, t, s.weights, to.normals, u, n.weights, true, s.on_face, sums.normal);
      compare(from.texcoords, t, s.weights, to.texcoords, u, n.weights, false, s.on_face,
              sums.texture);
    }
    const std::size_t n = ++done, hundredth = std::max<std::size_t>(blocks.size() / 100, 1);
    if (n % hundredth == 0) progress.at(double(n) / double(blocks.size()));
  });
  Sums total;
  for (const Sums& b : blocks) total.add(b);
  total.left_out = all - samples.size();
  return total;
}

OneSidedDistance one_sided(const Sums& s) {
  const double n = double(std::max<std::uint64_t>(1, s.faces));
  return {std::sqrt(s.max2), std::sqrt(s.sum2 / n), s.sum / n, s.samples, s.left_out};
}

double diagonal(const Tin& tin) {
  Vec3 low = tin.vertices[tin.triangles[0][0]], high = low;
  for (const Triangle& t : tin.triangles) {
    for (const auto v : t) {
      const Vec3& p = tin.vertices[v];
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
  }
  return length(high - low);
}

}  // namespace

SurfaceDistance surface_distance(const Tin& a, const Tin& b, const SurfaceSampling& sampling,
                                 const Progress& progress) {
  const std::uint64_t finer = std::max(a.triangles.size(), b.triangles.size());
  const std::uint64_t count = sampling.face_samples > 0
                                  ? sampling.face_samples
                                  : std::max<std::uint64_t>(100000, 10 * finer);
  const Progress first = progress.part(0, .5), second = progress.part(.5, 1);
  Sums there = measure(a, b, count, sampling, first);
  const Sums back = measure(b, a, count, sampling, second);
  SurfaceDistance d;
  d.a_to_b = one_sided(there);
  d.b_to_a = one_sided(back);
  d.max = std::max(d.a_to_b.max, d.b_to_a.max);
  d.rms = std::max(d.a_to_b.rms, d.b_to_a.rms);
  d.diagonal = diagonal(a);
  there.add(back);
  if (!a.colours.empty() && !b.colours.empty()) d.colour = there.colour.error();
  if (!a.normals.empty() && !b.normals.empty()) d.normal = there.normal.error();
  if (!a.texcoords.empty() && !b.texcoords.empty()) d.texture = there.texture.error();
  return d;
}

}  // namespace tind
