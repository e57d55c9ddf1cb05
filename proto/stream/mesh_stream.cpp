// One walk serves both directions: code_split asks its coder for each number, in one order, with
// the same models; an encoding coder is given the number, a decoding one finds it.
//
// What makes records small ([Pajarola00] for the batches): vertices as gaps in sorted order; left
// and right as places in the vertex's ring; the new vertex against the middle of the faces that go
// over to it, its height against the coarse surface there; the old vertex mostly does not move.

#include "proto/stream/mesh_stream.h"

#include <bit>
#include <cmath>
#include <memory>

#include "proto/stream/mesh_stream_start.h"
#include "proto/stream/range_coder.h"
#include "proto/stream/split_topology.h"

namespace tind::proto {

namespace {

constexpr std::uint32_t kTreeValence = 32;

struct Models {
  NumberModel count, gap, added_xy[2][16], added_z[16], fine_xy[16], fine_z[2][16];
  Bit new_generation, both_sides, moved;
  Bit left[kTreeValence + 1][32], span[kTreeValence + 1][32];
};

int width(std::int64_t v) {
  return std::min(15, int(std::bit_width(std::uint64_t(v < 0 ? -v : v))));
}

/// The state that both directions keep.
struct Walk {
  StreamFrame frame;
  SplitTopology topology;
  std::vector<LatticePoint> position;
  SplitTopology::Fan fan;
  std::uint32_t previous = 0;         // the next vertex of this generation is at least this
  std::uint32_t first = 0, over = 0;  // ring place of left, faces that go over
  SplitTopology::Place place;

  const LatticePoint& ring(std::size_t i) const { return position[fan.ring[i % fan.ring.size()]]; }
};

/// The height of the star of c at (x, y): of the face that holds the place, or comes nearest to it.
std::int64_t star_height(const Walk& w, const LatticePoint& c, double x, double y) {
  double best = -1e300, height = c[2];
  const double cx = c[0], cy = c[1], cz = c[2];
  for (std::size_t i = 0; i < w.fan.edges.size(); ++i) {
    const LatticePoint &p = w.ring(i), &q = w.ring(i + 1);
    const double px = p[0] - cx, py = p[1] - cy, qx = q[0] - cx, qy = q[1] - cy;
    const double area = px * qy - py * qx, dx = x - cx, dy = y - cy;
    const double wp = (dx * qy - dy * qx) / area, wq = (px * dy - py * dx) / area;
    const double wc = 1 - wp - wq;
    const double inside = std::min(wc, std::min(wp, wq));
    if (inside > best) {
      best = inside;
      height = cz + (wp * (p[2] - cz) + wq * (q[2] - cz));
    }
  }
  return std::int64_t(std::clamp(std::floor(height + 0.5), -1e9, 1e9));
}

/// A place among `count`, with a tree for each valence; above kTreeValence as plain bits.
template <class N>
std::uint32_t code_place(N& n, Bit (*trees)[32], std::size_t valence, std::uint32_t v) {
  const int depth = int(std::bit_width(valence - 1));
  if (valence <= kTreeValence) return n.tree(trees[valence], depth, v);
  return n.raw(v, depth);
}

/// Which vertex, and which of its faces go over. False: no such place (decoding only).
template <class N>
bool code_topology(N& n, Models& m, Walk& w, LatticeSplit& s) {
  s.vertex =
      w.previous + std::uint32_t(n.number(m.gap, std::int64_t(s.vertex) - w.previous, false));
  if (s.vertex < w.previous || s.vertex >= w.topology.vertices()) return false;
  w.previous = s.vertex + 1;
  w.topology.fan(s.vertex, w.fan);
  const std::size_t valence = w.fan.ring.size();
  const bool both = !w.fan.border || n.bit(m.both_sides, s.right != LatticeSplit::kNone);
  const auto find = [&](std::uint32_t v) {
    return std::uint32_t(std::ranges::find(w.fan.ring, v) - w.fan.ring.begin());
  };
  w.first = code_place(n, m.left, valence, find(s.left));
  if (w.first >= valence) return false;
  s.left = w.fan.ring[w.first];
  const auto after = std::uint32_t(valence - 1 - w.first);
  if (both) {
    const auto most = w.fan.border ? after : std::uint32_t(valence - 1);
    const std::uint32_t right = find(s.right);
    const std::uint32_t over = (right + std::uint32_t(valence) - w.first) % std::uint32_t(valence);
    w.over = 1 + code_place(n, m.span, valence, over - 1);
    if (w.over > most) return false;
    s.right = w.fan.ring[(w.first + w.over) % valence];
  } else {
    w.over = after;
    s.right = LatticeSplit::kNone;
  }
  w.place = w.over > 0 ? SplitTopology::Place{w.fan.edges[w.first], false}
                       : SplitTopology::Place{SplitTopology::prev(w.fan.edges.back()), true};
  return true;
}

/// In space all three axes are told alike: the new vertex against the middle, the old one where it
/// was or opposite.
template <class N>
void code_in_space(N& n, Models& m, const Walk& w, const LatticeSplit& s,
                   std::array<std::int64_t, 3>& added, std::array<std::int64_t, 3>& fine) {
  const LatticePoint& c = w.position[s.vertex];
  const std::int64_t count = w.over + 1;
  std::array<std::int64_t, 3> guess{};
  std::int64_t offset = 0;
  for (int k = 0; k < 3; ++k) {
    std::int64_t sum = c[k] * count;
    for (std::uint32_t i = 0; i <= w.over; ++i) sum += w.ring(w.first + i)[k];
    guess[k] = std::int64_t(std::floor(double(sum) / double(2 * count)));
    offset = std::max(offset, std::abs(guess[k] - c[k]));
  }
  const bool moved = n.bit(m.moved, s.fine != c);
  const int near = width(offset);
  for (int k = 0; k < 3; ++k)
    added[k] = guess[k] + n.number(m.added_xy[moved][near], s.added[k] - guess[k]);
  for (int k = 0; k < 3; ++k) {
    const std::int64_t mirrored = 2 * std::int64_t(c[k]) - added[k];
    fine[k] = moved ? mirrored + n.number(m.fine_xy[near], s.fine[k] - mirrored) : c[k];
  }
}

template <class N>
void code_on_terrain(N& n, Models& m, const Walk& w, const LatticeSplit& s,
                     std::array<std::int64_t, 3>& added, std::array<std::int64_t, 3>& fine) {
  const LatticePoint& c = w.position[s.vertex];
  double middle[2] = {0, 0}, low = c[2], high = c[2];
  for (std::uint32_t i = 0; i <= w.over; ++i) {
    const LatticePoint& p = w.ring(w.first + i);
    middle[0] += p[0], middle[1] += p[1];
    low = std::min(low, double(p[2])), high = std::max(high, double(p[2]));
  }
  const double count = w.over + 1;
  std::int64_t guess[2];
  for (int k = 0; k < 2; ++k)
    guess[k] = std::int64_t(std::floor((c[k] * count + middle[k]) / (2 * count)));
  const bool moved = n.bit(m.moved, s.fine[0] != c[0] || s.fine[1] != c[1]);
  const int near = width(std::max(std::abs(guess[0] - c[0]), std::abs(guess[1] - c[1])));
  const int rough = width(std::int64_t(high - low));

  for (int k = 0; k < 2; ++k)
    added[k] = guess[k] + n.number(m.added_xy[moved][near], s.added[k] - guess[k]);
  const std::int64_t surface = star_height(w, c, double(added[0]), double(added[1]));
  added[2] = surface + n.number(m.added_z[rough], s.added[2] - surface);
  std::int64_t level = c[2];
  for (int k = 0; k < 2; ++k) {
    const std::int64_t mirrored = 2 * std::int64_t(c[k]) - added[k];
    fine[k] = moved ? mirrored + n.number(m.fine_xy[near], s.fine[k] - mirrored) : c[k];
  }
  if (moved) level = star_height(w, c, double(fine[0]), double(fine[1]));
  fine[2] = level + n.number(m.fine_z[moved][rough], s.fine[2] - level);
}

template <class N>
bool code_positions(N& n, Models& m, const Walk& w, LatticeSplit& s) {
  std::array<std::int64_t, 3> added{}, fine{};
  if (w.frame == StreamFrame::space)
    code_in_space(n, m, w, s, added, fine);
  else
    code_on_terrain(n, m, w, s, added, fine);
  for (int k = 0; k < 3; ++k) {
    const std::int64_t most = largest_coordinate(w.frame, k);
    if (std::abs(added[k]) > most || std::abs(fine[k]) > most) return false;
    s.added[k] = std::int32_t(added[k]), s.fine[k] = std::int32_t(fine[k]);
  }
  return true;
}

/// On terrain all faces of the two new stars are counter-clockwise.
bool stays_valid(const Walk& w, const LatticeSplit& s) {
  if (w.frame == StreamFrame::space) return true;
  const std::size_t valence = w.fan.ring.size();
  for (std::size_t i = 0; i < w.fan.edges.size(); ++i) {
    const bool over = (i + valence - w.first) % valence < w.over;
    if (orient(over ? s.added : s.fine, w.ring(i), w.ring(i + 1)) <= 0) return false;
  }
  if (orient(s.added, s.fine, w.position[s.left]) <= 0) return false;
  return s.right == LatticeSplit::kNone || orient(s.fine, s.added, w.position[s.right]) > 0;
}

void apply(Walk& w, const LatticeSplit& s) {
  w.topology.split(w.place, s.right);
  w.position[s.vertex] = s.fine;
  w.position.push_back(s.added);
}

template <class N>
void code_block(N& n, Models& m, StreamBlock& b) {
  b.splits = std::uint32_t(n.number(m.count, b.splits, false));
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(b.error_m);
  const std::uint32_t high = n.raw(bits >> 16, 16);
  b.error_m = std::bit_cast<float>(high << 16 | n.raw(bits & 0xffff, 16));
}

/// A coder that learns can be taught to say a split in a hundredth of a byte, and each takes about
/// 250 bytes of memory while a list grows. Splits of surfaces take two bytes and more.
constexpr std::size_t kFreeSplits = 1024, kSplitsPerByte = 2;
bool too_many(std::size_t splits, std::size_t bytes) {
  return splits > kFreeSplits + kSplitsPerByte * bytes;
}
constexpr const char* kTooMany = "there are more than two splits a byte, which no surface has";

}  // namespace

Result<std::vector<std::uint8_t>> encode(const MeshStream& stream) {
  if (stream.total_splits != stream.splits.size())
    return fail(Errc::bad_data, "a part of a stream cannot be written, only a whole one");
  std::string problem;
  Walk w{stream.frame,
         SplitTopology(stream.base_triangles, stream.base_vertices.size(), stream.splits.size(),
                       problem),
         stream.base_vertices,
         {},
         0,
         0,
         0,
         {}};
  if (!problem.empty()) return fail(Errc::bad_data, problem);
  std::vector<std::uint8_t> out = encode_start(stream);
  if (stream.splits.empty()) return out;
  const std::size_t start = out.size();
  RangeEncoder coder(out);
  Numbers<RangeEncoder> n(coder);
  const auto models = std::make_unique<Models>();
  std::size_t at = 0;
  for (StreamBlock b : stream.blocks) {
    code_block(n, *models, b);
    for (std::uint32_t i = 0; i < b.splits; ++i, ++at) {
      if (at == stream.splits.size())
        return fail(Errc::bad_data, "the blocks hold more splits than there are");
      LatticeSplit s = stream.splits[at];
      if (i == 0 || s.vertex < w.previous) {
        if (i > 0) n.bit(models->new_generation, true);
        w.previous = 0;
      } else {
        n.bit(models->new_generation, false);
      }
      const auto known = std::uint32_t(w.topology.vertices());
      if (s.vertex >= known ||
          w.topology.place(s.vertex, s.left, s.right).edge == SplitTopology::kNone ||
          !code_topology(n, *models, w, s) || !code_positions(n, *models, w, s))
        return fail(Errc::bad_data, "split " + std::to_string(at) + " cannot be applied");
      if (too_many(at + 1, start + coder.asked())) return fail(Errc::bad_data, kTooMany);
      apply(w, s);
    }
  }
  if (at != stream.splits.size())
    return fail(Errc::bad_data, "the blocks hold fewer splits than there are");
  coder.finish();
  return out;
}

Result<MeshStream> decode_mesh_stream(std::span<const std::uint8_t> bytes) {
  MeshStream stream;
  const auto start = decode_start(bytes, stream);
  if (!start) return std::unexpected(start.error());
  std::string problem;
  Walk w{stream.frame,
         SplitTopology(stream.base_triangles, stream.base_vertices.size(), 0, problem),
         stream.base_vertices,
         {},
         0,
         0,
         0,
         {}};
  if (!problem.empty()) return fail(Errc::bad_data, problem);
  stream.base_bytes = *start;
  const auto body = bytes.subspan(*start);
  if (stream.total_splits == 0) {
    if (!body.empty())
      return fail(Errc::bad_data, "there are bytes after the end of the .tpm stream");
    return stream;
  }
  RangeDecoder coder(body);
  Numbers<RangeDecoder> n(coder);
  const auto models = std::make_unique<Models>();
  const auto wrong = [&](const char* what) {
    return fail(Errc::bad_data, "split " + std::to_string(stream.splits.size()) + ": " + what);
  };
  while (stream.splits.size() < stream.total_splits) {
    StreamBlock b;
    code_block(n, *models, b);
    if (!coder.certain()) return stream;
    if (b.splits == 0 || b.splits > stream.total_splits - stream.splits.size() ||
        !(b.error_m >= 0) || (!stream.blocks.empty() && b.error_m > stream.blocks.back().error_m))
      return wrong("its block makes no sense");
    stream.blocks.push_back({0, b.error_m});
    stream.block_bytes.push_back(std::uint32_t(*start + coder.asked()));
    for (std::uint32_t i = 0; i < b.splits; ++i) {
      if (i == 0 || n.bit(models->new_generation)) w.previous = 0;
      LatticeSplit s;
      const bool fits = code_topology(n, *models, w, s) && code_positions(n, *models, w, s);
      if (!coder.certain()) return stream;
      if (!fits) return wrong("it names what is not there");
      if (!stays_valid(w, s)) return wrong("it would flip a triangle");
      if (too_many(stream.splits.size() + 1, *start + coder.asked())) return wrong(kTooMany);
      apply(w, s);
      stream.splits.push_back(s);
      stream.split_bytes.push_back(std::uint32_t(*start + coder.asked()));
      ++stream.blocks.back().splits;
    }
  }
  if (coder.asked() != body.size())
    return fail(Errc::bad_data, "there are bytes after the end of the .tpm stream");
  return stream;
}

std::size_t bytes_until(const MeshStream& stream, const StreamLimit& limit) {
  std::size_t state = 0, triangles = stream.base_triangles.size();
  for (std::size_t b = 0; b < stream.blocks.size(); ++b) {
    if (double(stream.blocks[b].error_m) <= limit.max_error_m) return stream.block_bytes[b];
    for (std::uint32_t i = 0; i < stream.blocks[b].splits; ++i, ++state) {
      triangles += stream.splits[state].right == LatticeSplit::kNone ? 1 : 2;
      if (triangles > limit.triangles)
        return state == 0 ? stream.block_bytes[0]
                          : std::max(stream.block_bytes[b], stream.split_bytes[state - 1]);
    }
  }
  return stream.splits.empty() ? stream.base_bytes : stream.split_bytes.back();
}

}  // namespace tind::proto
