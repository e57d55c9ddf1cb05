// A header of fixed size, then one array after the other: what a client can hand to its graphics
// card as it is. Compression is left to HTTP.

#include "proto/stream/transition.h"

#include <cmath>

#include "terrain/base/bytes.h"

namespace tind::proto {

namespace {

constexpr std::uint32_t kMagic = 0x52544e54;  // "TNTR"
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeader = 64;

template <class Array>
void put_array(ByteWriter<>& out, const std::vector<Array>& values) {
  for (const Array& value : values)
    for (const std::uint32_t x : value) out.put(x);
}
void put_array(ByteWriter<>& out, const std::vector<double>& values) {
  for (const double x : values) out.put(x);
}

template <class Array>
void get_array(ByteReader& in, std::vector<Array>& values, std::size_t count) {
  values.resize(count);
  for (Array& value : values)
    for (std::uint32_t& x : value) x = in.get<std::uint32_t>();
}
void get_array(ByteReader& in, std::vector<double>& values, std::size_t count) {
  values.resize(count);
  for (double& x : values) x = in.get<double>();
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
  std::vector<std::uint8_t> bytes;
  bytes.reserve(kHeader + 32 * t.u.size() + 12 * (t.triangles.size() + t.splits.size()));
  ByteWriter out(bytes);
  for (const std::uint32_t x : {kMagic, kVersion, t.level, t.x, t.y, std::uint32_t(t.u.size()),
                                std::uint32_t(t.triangles.size()), std::uint32_t(t.splits.size()),
                                t.border_splits, t.fine_vertices, 0u, 0u})
    out.put(x);
  out.put(t.coarse_error_m), out.put(t.fine_error_m);
  for (const auto* values : {&t.u, &t.v, &t.coarse_z, &t.fine_z}) put_array(out, *values);
  put_array(out, t.triangles);
  put_array(out, t.splits);
  return bytes;
}

Result<Transition> decode_transition(std::span<const std::uint8_t> bytes) {
  const auto bad = [](std::string why) { return fail(Errc::bad_data, std::move(why)); };
  if (bytes.size() < kHeader) return bad("shorter than its header");
  ByteReader in(bytes);
  const auto number = [&] { return in.get<std::uint32_t>(); };
  if (number() != kMagic) return bad("not a transition");
  if (const auto version = number(); version != kVersion)
    return bad("version " + std::to_string(version) + " is not known");
  Transition t;
  t.level = number(), t.x = number(), t.y = number();
  const std::uint32_t vertices = number(), triangles = number(), splits = number();
  t.border_splits = number(), t.fine_vertices = number();
  number(), number();  // reserved
  t.coarse_error_m = in.get<double>(), t.fine_error_m = in.get<double>();
  const std::uint64_t size = kHeader + 32 * std::uint64_t(vertices) +
                             12 * (std::uint64_t(triangles) + std::uint64_t(splits));
  if (size != bytes.size()) return bad("its counts ask for " + std::to_string(size) + " bytes");
  if (splits > vertices || t.border_splits > splits || t.fine_vertices > vertices)
    return bad("its counts do not fit each other");
  for (auto* values : {&t.u, &t.v, &t.coarse_z, &t.fine_z}) {
    get_array(in, *values, vertices);
    for (const double value : *values)
      if (!std::isfinite(value)) return bad("a coordinate is not a number");
  }
  get_array(in, t.triangles, triangles);
  get_array(in, t.splits, splits);
  if (std::string why = wrong_indices(t, vertices - splits); !why.empty())
    return bad(std::move(why));
  return t;
}

}  // namespace tind::proto
