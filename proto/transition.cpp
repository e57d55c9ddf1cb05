// A header of fixed size, then one array after the other: what a client can hand to its graphics
// card as it is. Compression is left to HTTP.

#include "proto/transition.h"

#include <bit>
#include <cmath>
#include <cstring>

namespace tind::proto {

namespace {

static_assert(std::endian::native == std::endian::little);
constexpr std::uint32_t kMagic = 0x52544e54;  // "TNTR"
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeader = 64;

struct Header {
  std::uint32_t magic = kMagic, version = kVersion, level, x, y, vertices, triangles, splits,
                border_splits, fine_vertices, reserved[2] = {0, 0};
  double coarse_error_m, fine_error_m;
};
static_assert(sizeof(Header) == kHeader);

template <class T>
void append(std::vector<std::uint8_t>& out, const std::vector<T>& values) {
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(values.data());
  out.insert(out.end(), bytes, bytes + values.size() * sizeof(T));
}

template <class T>
void take(std::span<const std::uint8_t>& in, std::vector<T>& values, std::size_t count) {
  values.resize(count);
  if (count > 0) std::memcpy(values.data(), in.data(), count * sizeof(T));
  in = in.subspan(count * sizeof(T));
}

std::string wrong_indices(const Transition& t, std::size_t base) {
  for (const auto& triangle : t.triangles)
    for (const std::uint32_t v : triangle)
      if (v >= base) return "a triangle names a vertex that is not in the coarse mesh";
  for (std::size_t i = 0; i < t.splits.size(); ++i) {
    const auto& [vertex, left, right] = t.splits[i];
    const std::size_t known = base + i;
    if (vertex >= known || left >= known || (right >= known && right != Transition::kNone))
      return "split " + std::to_string(i) + " names a vertex that is not there yet";
    if (vertex == left || vertex == right || left == right)
      return "split " + std::to_string(i) + " names a vertex twice";
  }
  return {};
}

}  // namespace

std::vector<std::uint8_t> encode(const Transition& t) {
  Header h{};
  h.level = t.level, h.x = t.x, h.y = t.y;
  h.vertices = std::uint32_t(t.u.size());
  h.triangles = std::uint32_t(t.triangles.size());
  h.splits = std::uint32_t(t.splits.size());
  h.border_splits = t.border_splits, h.fine_vertices = t.fine_vertices;
  h.coarse_error_m = t.coarse_error_m, h.fine_error_m = t.fine_error_m;
  std::vector<std::uint8_t> out(kHeader);
  std::memcpy(out.data(), &h, kHeader);
  for (const auto* values : {&t.u, &t.v, &t.coarse_z, &t.fine_z}) append(out, *values);
  append(out, t.triangles);
  append(out, t.splits);
  return out;
}

std::optional<Transition> decode_transition(std::span<const std::uint8_t> bytes,
                                            std::string& error) {
  const auto bad = [&](std::string why) {
    error = std::move(why);
    return std::nullopt;
  };
  if (bytes.size() < kHeader) return bad("shorter than its header");
  Header h{};
  std::memcpy(&h, bytes.data(), kHeader);
  if (h.magic != kMagic) return bad("not a transition");
  if (h.version != kVersion) return bad("version " + std::to_string(h.version) + " is not known");
  const std::uint64_t size = kHeader + 32 * std::uint64_t(h.vertices) +
                             12 * (std::uint64_t(h.triangles) + std::uint64_t(h.splits));
  if (size != bytes.size()) return bad("its counts ask for " + std::to_string(size) + " bytes");
  if (h.splits > h.vertices || h.border_splits > h.splits || h.fine_vertices > h.vertices)
    return bad("its counts do not fit each other");
  Transition t;
  t.level = h.level, t.x = h.x, t.y = h.y;
  t.border_splits = h.border_splits, t.fine_vertices = h.fine_vertices;
  t.coarse_error_m = h.coarse_error_m, t.fine_error_m = h.fine_error_m;
  bytes = bytes.subspan(kHeader);
  for (auto* values : {&t.u, &t.v, &t.coarse_z, &t.fine_z}) {
    take(bytes, *values, h.vertices);
    for (const double value : *values)
      if (!std::isfinite(value)) return bad("a coordinate is not a number");
  }
  take(bytes, t.triangles, h.triangles);
  take(bytes, t.splits, h.splits);
  if (std::string why = wrong_indices(t, h.vertices - h.splits); !why.empty())
    return bad(std::move(why));
  return t;
}

}  // namespace tind::proto
