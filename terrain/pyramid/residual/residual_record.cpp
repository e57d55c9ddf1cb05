// First what others ask for most, with a hash of its own: facts, and the nodes along the sides.
// Then the nodes inside, each less what the nodes to its west, north and north-west predict, in
// groups of numbers of one width, which are read many at a time; residuals as one byte each.

#include "terrain/pyramid/residual/residual_record.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "terrain/base/bytes.h"
#include "terrain/base/hash.h"

namespace tind {

namespace {

constexpr int kCells = ResidualRecord::kCells, kNodes = ResidualRecord::kNodes;
constexpr int kPieces = ResidualRecord::kPieces;
constexpr std::uint32_t kMostSteps = ResidualRecord::kMostSteps;
enum Kind : std::uint8_t { kNothing, kPosts, kHeights };  // of a record: what it has

std::size_t node(int col, int row) { return std::size_t(row) * kNodes + std::size_t(col); }

// --- residuals as bytes --------------------------------------------------------------------------
// A positive float's upper bits (8 of its exponent, 5 of its mantissa) are a number that grows with
// it, by 2 to 3 % a step. A piece says the one of its largest residual; each byte how many steps a
// residual is below that: 255 is the largest, 1 all that are 254 steps or more below it.

constexpr int kDropped = 18;  // bits of the mantissa

std::uint32_t rounded_up(float x) {
  return (std::bit_cast<std::uint32_t>(x) + ((1u << kDropped) - 1)) >> kDropped;
}
float value(std::uint32_t code) { return std::bit_cast<float>(code << kDropped); }
constexpr std::uint32_t kLargestCode = (0x7f800000u >> kDropped) - 1;  // finite

std::uint8_t to_byte(float residual, std::uint32_t top) {
  if (residual < 0) return 0;
  const std::uint32_t below = top - rounded_up(residual);
  return std::uint8_t(below >= 254 ? 1 : 255 - below);
}
float from_byte(std::uint8_t byte, std::uint32_t top) {
  if (byte == 0) return ResidualRecord::kEmpty;
  const std::uint32_t below = 255 - byte;
  return below > top ? 0 : value(top - below);
}

// --- sides ---------------------------------------------------------------------------------------

/// The side whose k-th node is heights[from + k * by].
void put_side(ByteWriter<>& out, const std::vector<std::int32_t>& heights, std::size_t from,
              std::size_t by) {
  std::int64_t before = 0;
  for (std::size_t k = 0; k < std::size_t(kNodes); ++k) {
    const std::int32_t h = heights[from + k * by];
    out.put_signed_varint(h - before);
    before = h;
  }
}

/// false: no heights.
bool get_side(ByteReader& in, ResidualHead::Side& side) {
  std::int64_t h = 0;
  bool sound = true;
  for (std::int32_t& node : side) {
    h += in.get_signed_varint();
    sound &= std::abs(h) <= std::int64_t(kMostSteps);
    node = std::int32_t(h);
  }
  return sound && in.good();
}

// --- the nodes inside ----------------------------------------------------------------------------

constexpr int kGroup = 16;
constexpr int kInside = kNodes - 2;  // a row

/// In two's complement, so that numbers of bytes that nobody made do no harm.
std::uint32_t code_of(std::uint32_t difference) {
  return (difference << 1) ^ (0 - (difference >> 31));
}
std::uint32_t difference_of(std::uint32_t code) { return (code >> 1) ^ (0 - (code & 1)); }

/// A row without its ends; `above` is the row to its north.
void put_row(ByteWriter<>& out, const std::int32_t* here, const std::int32_t* above) {
  std::array<std::uint32_t, kGroup> codes;
  for (int first = 1; first <= kInside; first += kGroup) {
    const int count = std::min(kGroup, kInside + 1 - first);
    std::uint32_t all = 0;
    for (int k = 0; k < count; ++k) {
      const int col = first + k;
      codes[std::size_t(k)] =
          code_of(std::uint32_t(here[col] - here[col - 1] - above[col] + above[col - 1]));
      all |= codes[std::size_t(k)];
    }
    const int width = all == 0 ? 0 : all < 1 << 8 ? 1 : all < 1 << 16 ? 2 : 4;
    out.put(std::uint8_t(width));
    for (int k = 0; k < count; ++k) {
      const std::uint32_t code = codes[std::size_t(k)];
      if (width == 1) out.put(std::uint8_t(code));
      if (width == 2) out.put(std::uint16_t(code));
      if (width == 4) out.put(code);
    }
  }
}

template <Number Code>
void get_group(std::span<const std::uint8_t> bytes, std::uint32_t* differences) {
  for (std::size_t k = 0; k < bytes.size() / sizeof(Code); ++k)
    differences[k] = difference_of(load<Code>(&bytes[k * sizeof(Code)]));
}

/// The same back, of which here[0] is known. false: no heights.
bool get_row(ByteReader& in, std::int32_t* here, const std::int32_t* above) {
  std::array<std::uint32_t, kNodes> differences{};
  for (int first = 1; first <= kInside; first += kGroup) {
    const auto count = std::size_t(std::min(kGroup, kInside + 1 - first));
    const auto width = in.get<std::uint8_t>();
    if (width > 4 || width == 3) return false;
    const auto bytes = in.get_bytes(count * width);
    std::uint32_t* const to = &differences[std::size_t(first)];
    if (width == 1) get_group<std::uint8_t>(bytes, to);
    if (width == 2) get_group<std::uint16_t>(bytes, to);
    if (width == 4) get_group<std::uint32_t>(bytes, to);
  }
  std::uint32_t beyond = 0, rise = std::uint32_t(here[0]) - std::uint32_t(above[0]);
  for (int col = 1; col <= kInside; ++col) {
    rise += differences[std::size_t(col)];
    const std::uint32_t h = std::uint32_t(above[col]) + rise;
    here[col] = std::int32_t(h);
    beyond |= std::uint32_t(h + kMostSteps > 2 * kMostSteps);
  }
  return beyond == 0 && in.good();
}

/// f(child index, its east, its north)
template <class F>
void each_child(F&& f) {
  for (int north = 0; north < 2; ++north)
    for (int east = 0; east < 2; ++east) f(2 * std::size_t(north) + std::size_t(east), east, north);
}

/// Where a child's first column and row are, in columns and rows of `count` to a child.
struct Corner {
  int col, row;
};
Corner corner_of(int east, int north, int count) { return {east * count, (1 - north) * count}; }

}  // namespace

void accumulate_piece(ResidualRecord& r, int k, double step_m) {
  const int side = kCells >> k, cell = 1 << k, half = cell / 2;
  const auto& finer = r.pieces[std::size_t(k - 1)];
  auto& piece = r.pieces[std::size_t(k)];
  piece.assign(std::size_t(side) * std::size_t(side), ResidualRecord::kEmpty);
  const auto height = [&](int col, int row) { return r.heights[node(col, row)] * step_m; };
  for (int row = 0; row < side; ++row)
    for (int col = 0; col < side; ++col) {
      const int x = col * cell, y = row * cell;
      const LatticeCell coarse{
          height(x, y + cell), height(x + cell, y + cell), height(x, y), height(x + cell, y), 0, 0,
          double(cell)};
      float& bound = piece[std::size_t(row) * side + col];
      for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
          const float own = finer[std::size_t(2 * row + j) * 2 * side + 2 * col + i];
          if (own < 0) continue;
          double apart = 0;
          for (const int n : {j, j + 1})
            for (const int m : {i, i + 1})
              apart = std::max(apart, std::abs(height(x + m * half, y + n * half) -
                                               coarse.at(m * half, cell - n * half)));
          bound = std::max(bound, std::nextafter(float(own + apart), HUGE_VALF));
        }
    }
}

ResidualRecord join(const std::array<const ResidualRecord*, 4>& children, double step_m) {
  static const ResidualRecord kNothing;
  const auto child = [&](int i) -> const ResidualRecord& {
    return children[std::size_t(i)] ? *children[std::size_t(i)] : kNothing;
  };
  const ResidualRecord &sw = child(0), &se = child(1), &nw = child(2), &ne = child(3);
  ResidualRecord r;
  // Posts on the sides that children share are owned by one of them.
  r.owned = sw.owned + se.owned + nw.owned + ne.owned;
  r.on_east = se.on_east + ne.on_east;
  r.on_north = nw.on_north + ne.on_north;
  r.on_corner = ne.on_corner;
  const auto each = {&sw, &se, &nw, &ne};
  if (std::ranges::all_of(each, [](const auto* c) { return c->heights.empty(); })) return r;
  r.heights.assign(std::size_t(kNodes) * kNodes, 0);
  each_child([&](std::size_t i, int east, int north) {
    if (!children[i] || children[i]->heights.empty()) return;
    const Corner at = corner_of(east, north, kCells / 2);
    for (int row = 0; row <= kCells / 2; ++row)  // what two children share, both know alike
      for (int col = 0; col <= kCells / 2; ++col)
        r.heights[node(at.col + col, at.row + row)] = children[i]->height(2 * col, 2 * row);
  });
  if (std::ranges::none_of(each, [](const auto* c) { return c->has_posts(); })) return r;
  for (int k = 0; k + 1 < kPieces; ++k) {
    const int side = kCells >> k, half = side / 2;
    auto& piece = r.pieces[std::size_t(k)];
    piece.assign(std::size_t(side) * std::size_t(side), ResidualRecord::kEmpty);
    each_child([&](std::size_t i, int east, int north) {
      if (!children[i] || !children[i]->has_posts()) return;
      r.min_m = std::min(r.min_m, children[i]->min_m);
      r.max_m = std::max(r.max_m, children[i]->max_m);
      const auto& part = children[i]->pieces[std::size_t(k) + 1];
      const Corner at = corner_of(east, north, half);
      for (int row = 0; row < half; ++row)
        std::copy_n(&part[std::size_t(row) * half], half,
                    &piece[std::size_t(at.row + row) * side + at.col]);
    });
  }
  accumulate_piece(r, kPieces - 1, step_m);
  return r;
}

std::vector<std::uint8_t> encode(const ResidualRecord& r) {
  std::vector<std::uint8_t> bytes;
  ByteWriter out(bytes);
  const bool flat = std::ranges::all_of(r.heights, [](std::int32_t h) { return h == 0; });
  const std::uint8_t kind = r.has_posts() ? kPosts : flat ? kNothing : kHeights;
  out.put(kind);
  if (kind == kNothing) return bytes;
  if (kind == kPosts) {
    out.put(r.min_m);
    out.put(r.max_m);
    for (const std::uint64_t n : {r.owned, r.on_east, r.on_north, r.on_corner}) out.put(n);
  }
  put_side(out, r.heights, node(0, 0), 1);
  put_side(out, r.heights, node(0, kCells), 1);
  put_side(out, r.heights, node(0, 0), kNodes);
  put_side(out, r.heights, node(kCells, 0), kNodes);
  out.put(hash64(bytes));
  for (int row = 1; row < kCells; ++row)
    put_row(out, &r.heights[node(0, row)], &r.heights[node(0, row - 1)]);
  if (kind == kHeights) return bytes;
  for (const auto& piece : r.pieces) {
    const float largest = std::max(0.0F, *std::ranges::max_element(piece));
    const std::uint32_t top = std::min(rounded_up(largest), kLargestCode);
    out.put(std::uint16_t(top));
    for (const float residual : piece) out.put(to_byte(residual, top));
  }
  return bytes;
}

namespace {

std::unexpected<Error> bad(const char* what) { return fail(Errc::bad_data, what); }

/// Leaves the reader behind it.
Result<ResidualHead> get_head(std::span<const std::uint8_t> bytes, ByteReader& in) {
  ResidualHead head;
  const auto kind = in.get<std::uint8_t>();
  if (!in.good() || kind > kHeights) return bad("not a record of a residual index");
  if (kind == kNothing) return head;
  if (kind == kPosts) {
    head.min_m = in.get<float>(), head.max_m = in.get<float>();
    if (!in.good() || !(std::abs(head.min_m) < 1e6F) || !(std::abs(head.max_m) < 1e6F) ||
        head.min_m > head.max_m)
      return bad("the range of heights is damaged");
    for (std::uint64_t* n : {&head.owned, &head.on_east, &head.on_north, &head.on_corner})
      *n = in.get<std::uint64_t>();
  }
  if (!in.good()) return bad("truncated");
  head.has_heights = true;
  for (ResidualHead::Side* side : {&head.north, &head.south, &head.west, &head.east})
    if (!get_side(in, *side)) return bad("the heights of the sides are damaged");
  const std::size_t end = in.at();
  if (in.get<std::uint64_t>() != hash64(bytes.first(end)) || !in.good())
    return bad("the heights of the sides are damaged");
  if (head.north.front() != head.west.front() || head.north.back() != head.east.front() ||
      head.south.front() != head.west.back() || head.south.back() != head.east.back())
    return bad("the sides do not meet");
  return head;
}

}  // namespace

Result<ResidualHead> decode_head(std::span<const std::uint8_t> bytes) {
  ByteReader in(bytes);
  return get_head(bytes, in);
}

Result<ResidualRecord> decode_record(std::span<const std::uint8_t> bytes) {
  ByteReader in(bytes);
  const auto head = get_head(bytes, in);
  if (!head) return std::unexpected(head.error());
  ResidualRecord r;
  static_cast<ResidualFacts&>(r) = *head;
  if (head->has_heights) {
    r.heights.resize(std::size_t(kNodes) * kNodes);
    std::ranges::copy(head->north, &r.heights[node(0, 0)]);
    for (int row = 1; row < kCells; ++row) {
      std::int32_t* const here = &r.heights[node(0, row)];
      here[0] = head->west[std::size_t(row)], here[kCells] = head->east[std::size_t(row)];
      if (!get_row(in, here, here - kNodes)) return bad("the heights are damaged");
    }
    std::ranges::copy(head->south, &r.heights[node(0, kCells)]);
    if (!r.has_posts() && std::ranges::all_of(r.heights, [](std::int32_t h) { return h == 0; }))
      return bad("heights that say nothing");
  }
  for (int k = 0; r.has_posts() && k < kPieces; ++k) {
    const auto top = in.get<std::uint16_t>();
    if (!in.good() || top > kLargestCode) return bad("the residuals are damaged");
    auto& piece = r.pieces[std::size_t(k)];
    piece.resize(std::size_t(kCells >> k) * std::size_t(kCells >> k));
    const auto said = in.get_bytes(piece.size());
    if (!in.good()) return bad("truncated");
    std::array<float, 256> values;
    for (std::size_t byte = 0; byte < values.size(); ++byte)
      values[byte] = from_byte(std::uint8_t(byte), top);
    for (std::size_t i = 0; i < piece.size(); ++i) piece[i] = values[said[i]];
  }
  if (in.left() > 0) return bad("bytes after the record");
  return r;
}

ResidualLattice lattice_of(std::span<const ResidualRecord* const> parts, double step_m) {
  int side = 1;
  while (std::size_t(side) * std::size_t(side) < parts.size()) side *= 2;
  ResidualLattice lattice;
  lattice.cells = side * kCells;
  const auto nodes = std::size_t(lattice.nodes()), cells = std::size_t(lattice.cells);
  lattice.heights.assign(nodes * nodes, 0);
  lattice.residual.assign(cells * cells, ResidualRecord::kEmpty);
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (!parts[k] || parts[k]->heights.empty()) continue;
    const std::size_t x = k % std::size_t(side) * kCells, y = k / std::size_t(side) * kCells;
    for (int row = 0; row < kNodes; ++row)
      for (int col = 0; col < kNodes; ++col)
        lattice.heights[(y + std::size_t(row)) * nodes + x + std::size_t(col)] =
            float(parts[k]->heights[node(col, row)] * step_m);
    if (!parts[k]->has_posts()) continue;
    for (int row = 0; row < kCells; ++row)
      std::copy_n(&parts[k]->pieces[0][std::size_t(row) * kCells], kCells,
                  &lattice.residual[(y + std::size_t(row)) * cells + x]);
  }
  return lattice;
}

}  // namespace tind
