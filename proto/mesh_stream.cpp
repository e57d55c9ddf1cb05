// One walk serves both directions: code_split asks its coder for each number, in one order, with
// the same models; an encoding coder is given the number, a decoding one finds it.
//
// What makes records small (Pajarola and Rossignac 2000 for the batches): vertices as gaps in
// sorted order; left and right as places in the vertex's ring; the new vertex against the middle of
// the faces that go over to it, its height against the coarse surface there; the old vertex mostly
// does not move.

#include "proto/mesh_stream.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <memory>

#include "proto/range_coder.h"
#include "proto/split_topology.h"

namespace tind::proto {

namespace {

constexpr std::size_t kHeader = 120;
constexpr std::int64_t kMaxXy = 1 << 29, kMaxZ = 1 << 30;
constexpr std::uint32_t kTreeValence = 32;

struct Models {
  NumberModel count, gap, added_xy[2][16], added_z[16], fine_xy[16], fine_z[2][16];
  Bit new_generation, both_sides, moved;
  Bit left[kTreeValence + 1][32], span[kTreeValence + 1][32];
};

int width(std::int64_t v) {
  return std::min(15, int(std::bit_width(std::uint64_t(v < 0 ? -v : v))));
}

std::int64_t orient(const LatticePoint& a, const LatticePoint& b, const LatticePoint& c) {
  return (std::int64_t(b[0]) - a[0]) * (std::int64_t(c[1]) - a[1]) -
         (std::int64_t(b[1]) - a[1]) * (std::int64_t(c[0]) - a[0]);
}

/// The state that both directions keep.
struct Walk {
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

template <class N>
bool code_positions(N& n, Models& m, const Walk& w, LatticeSplit& s) {
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

  std::int64_t added[3], fine[3];
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
  for (int k = 0; k < 3; ++k) {
    const std::int64_t most = k < 2 ? kMaxXy : kMaxZ;
    if (std::abs(added[k]) > most || std::abs(fine[k]) > most) return false;
    s.added[k] = std::int32_t(added[k]), s.fine[k] = std::int32_t(fine[k]);
  }
  return true;
}

/// All faces of the two new stars are counter-clockwise.
bool stays_valid(const Walk& w, const LatticeSplit& s) {
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

// ---- header and base ----

template <class T>
void put(std::vector<std::uint8_t>& out, T v) {
  std::array<std::uint8_t, sizeof v> bytes;  // of a little endian machine
  std::memcpy(bytes.data(), &v, sizeof v);
  for (const std::uint8_t b : bytes) out.push_back(b);
}
static_assert(std::endian::native == std::endian::little);

void put_signed(std::vector<std::uint8_t>& out, std::int64_t v) {
  std::uint64_t u = (std::uint64_t(v) << 1) ^ std::uint64_t(v >> 63);
  for (; u >= 128; u >>= 7) out.push_back(std::uint8_t(u | 128));
  out.push_back(std::uint8_t(u));
}

class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  template <class T>
  T get() {
    T v{};
    if (left() < sizeof v) {
      short_ = true;
    } else {
      std::memcpy(&v, bytes_.data() + at_, sizeof v);
      at_ += sizeof v;
    }
    return v;
  }
  std::int64_t get_signed() {
    std::uint64_t u = 0;
    for (int shift = 0;; shift += 7) {
      const auto b = get<std::uint8_t>();
      if (shift > 35) wrong_ = true;
      if (short_ || wrong_) return 0;
      u |= std::uint64_t(b & 127) << shift;
      if (b < 128) break;
    }
    return std::int64_t(u >> 1) ^ -std::int64_t(u & 1);
  }
  std::string text(std::size_t n) {
    if (left() < n) {
      short_ = true;
      return {};
    }
    at_ += n;
    return {reinterpret_cast<const char*>(bytes_.data()) + at_ - n, n};
  }
  std::size_t left() const { return bytes_.size() - at_; }
  std::size_t at() const { return at_; }
  bool ended() const { return short_; }
  bool wrong() const { return wrong_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  bool short_ = false, wrong_ = false;
};

std::vector<std::uint8_t> encode_base(const MeshStream& s) {
  std::vector<std::uint8_t> out;
  LatticePoint last{};
  for (const LatticePoint& p : s.base_vertices) {
    for (int k = 0; k < 3; ++k) put_signed(out, std::int64_t(p[k]) - last[k]);
    last = p;
  }
  std::int64_t index = 0;
  for (const auto& t : s.base_triangles) {
    for (const std::uint32_t v : t) {
      put_signed(out, std::int64_t(v) - index);
      index = v;
    }
  }
  return out;
}

std::string decode_base(Reader& in, MeshStream& s, std::size_t vertices, std::size_t triangles) {
  std::array<std::int64_t, 3> p{};
  for (std::size_t i = 0; i < vertices && !in.ended(); ++i) {
    for (int k = 0; k < 3; ++k) {
      p[k] += in.get_signed();
      if (in.wrong() || std::abs(p[k]) > (k < 2 ? kMaxXy : kMaxZ))
        return "vertex " + std::to_string(i) + " of the base is out of range";
    }
    s.base_vertices.push_back({std::int32_t(p[0]), std::int32_t(p[1]), std::int32_t(p[2])});
  }
  std::int64_t index = 0;
  for (std::size_t i = 0; i < triangles && !in.ended(); ++i) {
    std::array<std::uint32_t, 3> t{};
    for (std::uint32_t& v : t) {
      index += in.get_signed();
      if (in.wrong() || index < 0 || index >= std::int64_t(vertices))
        return "triangle " + std::to_string(i) + " of the base names a vertex that is not there";
      v = std::uint32_t(index);
    }
    const auto& b = s.base_vertices;
    if (orient(b[t[0]], b[t[1]], b[t[2]]) <= 0)
      return "triangle " + std::to_string(i) + " of the base is not counter-clockwise";
    s.base_triangles.push_back(t);
  }
  return {};
}

constexpr const char* kTooFew = "the bytes end before the base mesh does";

/// Header and base; the number of bytes that they take, or what is wrong.
std::expected<std::size_t, std::string> decode_start(std::span<const std::uint8_t> bytes,
                                                     MeshStream& s) {
  Reader in(bytes);
  if (in.text(4) != "TPM1") return std::unexpected("this is no .tpm stream");
  const auto version = in.get<std::uint16_t>();
  s.per_post = in.get<std::uint16_t>();
  s.z_step_m = in.get<double>();
  s.fine_error_m = in.get<double>();
  s.cols = in.get<std::uint32_t>();
  s.rows = in.get<std::uint32_t>();
  for (double& a : s.post_to_crs) a = in.get<double>();
  s.z_unit_m = in.get<double>();
  s.datum = std::uint8_t(in.get<std::uint32_t>());
  const std::size_t vertices = in.get<std::uint32_t>(), triangles = in.get<std::uint32_t>();
  s.total_splits = in.get<std::uint32_t>();
  const std::size_t crs = in.get<std::uint32_t>(), base = in.get<std::uint32_t>();
  in.get<std::uint64_t>();  // reserved
  if (in.ended()) return std::unexpected(kTooFew);
  if (version != 1)
    return std::unexpected("version " + std::to_string(version) + " of .tpm is not known here");
  if (s.per_post < 1 || s.per_post > 1024 || !std::has_single_bit(s.per_post) ||
      !(s.z_step_m > 0 && s.z_step_m < 1e6) || !(s.fine_error_m >= 0) || !(s.z_unit_m > 0) ||
      s.datum > 2 || vertices < 3 || triangles < 1 || vertices + std::size_t(s.total_splits) > ~0u)
    return std::unexpected("the header of the .tpm stream makes no sense");
  s.crs = in.text(crs);
  const std::size_t begin = in.at();
  if (in.ended() || in.left() < base) return std::unexpected(kTooFew);
  if (vertices * 3 + triangles * 3 > base)
    return std::unexpected("the base mesh has more numbers than bytes");
  if (const std::string wrong = decode_base(in, s, vertices, triangles); !wrong.empty())
    return std::unexpected(wrong);
  if (in.ended() || in.at() - begin != base)
    return std::unexpected("the base mesh is not as long as the header says");
  return in.at();
}

std::vector<std::uint8_t> encode_start(const MeshStream& s) {
  const std::vector<std::uint8_t> base = encode_base(s);
  std::vector<std::uint8_t> out = {'T', 'P', 'M', '1'};
  put(out, std::uint16_t(1));
  put(out, s.per_post);
  put(out, s.z_step_m);
  put(out, s.fine_error_m);
  put(out, s.cols);
  put(out, s.rows);
  for (const double a : s.post_to_crs) put(out, a);
  put(out, s.z_unit_m);
  put(out, std::uint32_t(s.datum));
  put(out, std::uint32_t(s.base_vertices.size()));
  put(out, std::uint32_t(s.base_triangles.size()));
  put(out, s.total_splits);
  put(out, std::uint32_t(s.crs.size()));
  put(out, std::uint32_t(base.size()));
  put(out, std::uint64_t(0));
  static_assert(kHeader == 4 + 2 + 2 + 8 + 8 + 4 + 4 + 48 + 8 + 4 + 4 + 4 + 4 + 4 + 4 + 8);
  out.insert(out.end(), s.crs.begin(), s.crs.end());
  out.insert(out.end(), base.begin(), base.end());
  return out;
}

}  // namespace

std::expected<std::vector<std::uint8_t>, std::string> encode(const MeshStream& stream) {
  if (stream.total_splits != stream.splits.size())
    return std::unexpected("a part of a stream cannot be written, only a whole one");
  std::string problem;
  Walk w{SplitTopology(stream.base_triangles, stream.base_vertices.size(), stream.splits.size(),
                       problem),
         stream.base_vertices,
         {},
         0,
         0,
         0,
         {}};
  if (!problem.empty()) return std::unexpected(problem);
  std::vector<std::uint8_t> out = encode_start(stream);
  if (stream.splits.empty()) return out;
  RangeEncoder coder(out);
  Numbers<RangeEncoder> n(coder);
  const auto models = std::make_unique<Models>();
  std::size_t at = 0;
  for (StreamBlock b : stream.blocks) {
    code_block(n, *models, b);
    for (std::uint32_t i = 0; i < b.splits; ++i, ++at) {
      if (at == stream.splits.size())
        return std::unexpected("the blocks hold more splits than there are");
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
        return std::unexpected("split " + std::to_string(at) + " cannot be applied");
      apply(w, s);
    }
  }
  if (at != stream.splits.size())
    return std::unexpected("the blocks hold fewer splits than there are");
  coder.finish();
  return out;
}

std::expected<MeshStream, std::string> decode_mesh_stream(std::span<const std::uint8_t> bytes) {
  MeshStream stream;
  const auto start = decode_start(bytes, stream);
  if (!start) return std::unexpected(start.error());
  std::string problem;
  Walk w{SplitTopology(stream.base_triangles, stream.base_vertices.size(), 0, problem),
         stream.base_vertices,
         {},
         0,
         0,
         0,
         {}};
  if (!problem.empty()) return std::unexpected(problem);
  const auto body = bytes.subspan(*start);
  if (stream.total_splits == 0) {
    if (!body.empty()) return std::unexpected("there are bytes after the end of the .tpm stream");
    return stream;
  }
  RangeDecoder coder(body);
  Numbers<RangeDecoder> n(coder);
  const auto models = std::make_unique<Models>();
  const auto wrong = [&](const char* what) {
    return std::unexpected("split " + std::to_string(stream.splits.size()) + ": " + what);
  };
  while (stream.splits.size() < stream.total_splits) {
    StreamBlock b;
    code_block(n, *models, b);
    if (!coder.certain()) return stream;
    if (b.splits == 0 || b.splits > stream.total_splits - stream.splits.size() ||
        !(b.error_m >= 0) || (!stream.blocks.empty() && b.error_m > stream.blocks.back().error_m))
      return wrong("its block makes no sense");
    stream.blocks.push_back({0, b.error_m});
    for (std::uint32_t i = 0; i < b.splits; ++i) {
      if (i == 0 || n.bit(models->new_generation)) w.previous = 0;
      LatticeSplit s;
      const bool fits = code_topology(n, *models, w, s) && code_positions(n, *models, w, s);
      if (!coder.certain()) return stream;
      if (!fits) return wrong("it names what is not there");
      if (!stays_valid(w, s)) return wrong("it would flip a triangle");
      apply(w, s);
      stream.splits.push_back(s);
      ++stream.blocks.back().splits;
    }
  }
  if (coder.asked() != body.size())
    return std::unexpected("there are bytes after the end of the .tpm stream");
  return stream;
}

}  // namespace tind::proto
