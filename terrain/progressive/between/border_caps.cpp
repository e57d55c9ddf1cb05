#include "terrain/progressive/between/border_caps.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace tind {

namespace {

using Index = HalfedgeMesh::Index;
constexpr Index kNone = HalfedgeMesh::kNone;
constexpr std::size_t kStarts = 16;  // places that are tried for the first vertex of a border

using Border = std::vector<Index>;  // vertices in order, the mesh on the left

std::vector<Border> borders(const HalfedgeMesh& m) {
  std::vector<Border> out;
  std::vector<char> seen(m.vertex_slots(), 0);
  for (Index v = 0; v < m.vertex_slots(); ++v) {
    if (seen[v] || !m.alive_vertex(v) || !m.on_border(v)) continue;
    out.emplace_back();
    for (Index w = v; !seen[w]; w = m.dest(m.out(w))) seen[w] = 1, out.back().push_back(w);
  }
  return out;
}

double square(const Vec3& d) { return dot(d, d); }

/// How far the one's vertices are from the other's.
double apart(const HalfedgeMesh& coarse, const Border& c, const HalfedgeMesh& fine,
             const Border& f) {
  double sum = 0;
  for (const Index v : c) {
    double least = HUGE_VAL;
    for (const Index w : f) least = std::min(least, square(coarse.position(v) - fine.position(w)));
    sum += std::sqrt(least);
  }
  return sum / double(c.size());
}

/// partner[i]: the fine border of coarse border i. Nearest pairs first.
std::vector<std::size_t> partners(const HalfedgeMesh& coarse, const std::vector<Border>& cs,
                                  const HalfedgeMesh& fine, const std::vector<Border>& fs) {
  struct Pair {
    double apart;
    std::size_t c, f;
    auto operator<=>(const Pair&) const = default;
  };
  std::vector<Pair> pairs;
  for (std::size_t c = 0; c < cs.size(); ++c)
    for (std::size_t f = 0; f < fs.size(); ++f)
      pairs.push_back({apart(coarse, cs[c], fine, fs[f]), c, f});
  std::ranges::sort(pairs);
  std::vector<std::size_t> partner(cs.size(), fs.size());
  std::vector<char> gone(fs.size(), 0);
  for (const Pair& p : pairs)
    if (partner[p.c] == fs.size() && !gone[p.f]) partner[p.c] = p.f, gone[p.f] = 1;
  return partner;
}

std::string place(const Vec3& p) {
  return "(" + std::to_string(p.x) + ", " + std::to_string(p.y) + ", " + std::to_string(p.z) + ")";
}

/// Longest edges first, until the border has `count` vertices.
std::size_t lengthen(HalfedgeMesh& m, Border& border, std::size_t count) {
  std::size_t added = 0;
  for (; border.size() < count; ++added) {
    const auto edge = [&](std::size_t i) {
      return square(m.position(m.dest(m.out(border[i]))) - m.position(border[i]));
    };
    std::size_t longest = 0;
    for (std::size_t i = 1; i < border.size(); ++i)
      if (edge(i) > edge(longest)) longest = i;
    const Index h = m.out(border[longest]);
    const Index v = m.split_edge(h, (m.position(m.origin(h)) + m.position(m.dest(h))) * 0.5);
    border.insert(border.begin() + std::ptrdiff_t(longest) + 1, v);
  }
  return added;
}

/// Fine vertices for the coarse ones, in their order, from fine place `start` on; and what
/// it costs.
struct Assignment {
  double cost = HUGE_VAL;
  std::vector<std::size_t> at;  // places on the fine border
};

Assignment assign_from(const HalfedgeMesh& coarse, const Border& c, const HalfedgeMesh& fine,
                       const Border& f, std::size_t start) {
  const std::size_t n = c.size(), m = f.size();
  const auto distance = [&](std::size_t i, std::size_t k) {
    return square(coarse.position(c[i]) - fine.position(f[(start + k) % m]));
  };
  // least[k]: coarse vertices 0..i on places 0..k, the last of them on k or before.
  std::vector<double> least(m, distance(0, 0)), next(m);
  std::vector<std::vector<char>> here(n, std::vector<char>(m, 0));  // i is on k, not before
  here[0][0] = 1;
  for (std::size_t i = 1; i < n; ++i) {
    std::fill(next.begin(), next.end(), HUGE_VAL);
    for (std::size_t k = i; k < m; ++k) {
      const double with = least[k - 1] + distance(i, k);
      here[i][k] = with < next[k - 1];
      next[k] = here[i][k] ? with : next[k - 1];
    }
    least.swap(next);
  }
  Assignment out{least[m - 1], std::vector<std::size_t>(n)};
  for (std::size_t i = n, k = m; i-- > 0;) {
    while (!here[i][--k]) continue;
    out.at[i] = (start + k) % m;
  }
  return out;
}

Assignment assign(const HalfedgeMesh& coarse, const Border& c, const HalfedgeMesh& fine,
                  const Border& f) {
  std::vector<std::size_t> starts(f.size());
  std::iota(starts.begin(), starts.end(), std::size_t(0));
  std::ranges::stable_sort(starts, {}, [&](std::size_t k) {
    return square(coarse.position(c[0]) - fine.position(f[k]));
  });
  starts.resize(std::min(starts.size(), kStarts));
  Assignment best;
  for (const std::size_t start : starts) {
    Assignment a = assign_from(coarse, c, fine, f, start);
    if (best.at.empty() || a.cost < best.cost) best = std::move(a);
  }
  return best;
}

/// The closed mesh; caps come last, in the order of the borders.
Result<HalfedgeMesh> capped(const HalfedgeMesh& m, const std::vector<Border>& all,
                            const std::vector<Vec3>& caps) {
  Tin tin = m.to_tin();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const auto cap = Index(tin.vertices.size());
    tin.vertices.push_back(caps[i]);
    for (std::size_t k = 0; k < all[i].size(); ++k)
      tin.triangles.push_back({all[i][(k + 1) % all[i].size()], all[i][k], cap});
  }
  return HalfedgeMesh::from_tin(tin);
}

}  // namespace

Result<CappedModels> cap_borders(HalfedgeMesh fine, HalfedgeMesh coarse) {
  const std::vector<Border> c = borders(coarse), open = borders(fine);
  const std::vector<std::size_t> partner = partners(coarse, c, fine, open);
  if (c.size() != open.size()) {
    const bool more = open.size() > c.size();
    std::size_t alone = 0;
    if (more)
      while (std::ranges::find(partner, alone) != partner.end()) ++alone;
    else
      while (partner[alone] != open.size()) ++alone;
    const Vec3 at = more ? fine.position(open[alone][0]) : coarse.position(c[alone][0]);
    return fail(Errc::invalid_argument, "the fine model has " + std::to_string(open.size()) +
                                            " borders, the coarse one " + std::to_string(c.size()) +
                                            ": the " + (more ? "fine" : "coarse") +
                                            " one's border at " + place(at) + " is alone");
  }
  CappedModels out;
  std::vector<Border> f;
  std::vector<Vec3> caps;
  for (std::size_t i = 0; i < c.size(); ++i) {
    f.push_back(open[partner[i]]);
    out.split_in += lengthen(fine, f[i], c[i].size());
    Vec3 middle;
    for (const Index v : c[i]) middle = middle + coarse.position(v) * (1 / double(c[i].size()));
    caps.push_back(middle);
  }
  out.caps = Index(c.size());
  out.first_fine_cap = Index(fine.vertex_slots());
  out.first_coarse_cap = Index(coarse.vertex_slots());
  out.representative.assign(coarse.vertex_slots() + c.size(), kNone);
  for (std::size_t i = 0; i < c.size(); ++i) {
    const Assignment a = assign(coarse, c[i], fine, f[i]);
    for (std::size_t k = 0; k < c[i].size(); ++k) out.representative[c[i][k]] = f[i][a.at[k]];
    out.representative[out.first_coarse_cap + i] = out.first_fine_cap + Index(i);
  }
  auto closed_fine = capped(fine, f, caps), closed_coarse = capped(coarse, c, caps);
  if (!closed_fine) return fail("the fine model", closed_fine.error());
  if (!closed_coarse) return fail("the coarse model", closed_coarse.error());
  out.fine = std::move(*closed_fine), out.coarse = std::move(*closed_coarse);
  return out;
}

}  // namespace tind
