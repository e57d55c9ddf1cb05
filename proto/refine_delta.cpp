// "TRF1", flags, token, place, four counts, then the four lists. Numbers are LEB128 varints; ids
// are differences from the one before, corners zig-zag differences from the corner before.

#include "proto/refine_delta.h"

#include <bit>
#include <cmath>
#include <cstring>

namespace tind::proto {

namespace {

constexpr std::string_view kMagic = "TRF1";

struct Writer {
  std::string bytes;

  void number(std::uint32_t v) {
    for (; v >= 128; v >>= 7) bytes.push_back(char(v | 128));
    bytes.push_back(char(v));
  }
  template <class T>
  void plain(T v) {
    static_assert(std::endian::native == std::endian::little);
    char raw[sizeof v];
    std::memcpy(raw, &v, sizeof v);
    bytes.append(raw, sizeof v);
  }
  void ids(const std::vector<std::uint32_t>& list) {
    std::uint32_t last = 0;
    for (const std::uint32_t id : list) number(id - last), last = id;
  }
};

struct Reader {
  std::string_view bytes;
  bool good = true;

  std::uint32_t number() {
    std::uint64_t v = 0;
    for (int shift = 0; shift < 35; shift += 7) {
      if (bytes.empty()) break;
      const auto b = std::uint8_t(bytes.front());
      bytes.remove_prefix(1);
      v |= std::uint64_t(b & 127) << shift;
      if (b < 128) return v <= 0xffffffffu ? std::uint32_t(v) : refuse();
    }
    return refuse();
  }
  template <class T>
  T plain() {
    T v{};
    if (bytes.size() < sizeof v) return refuse(), v;
    std::memcpy(&v, bytes.data(), sizeof v);
    bytes.remove_prefix(sizeof v);
    return v;
  }
  std::string_view text(std::size_t n) {
    if (bytes.size() < n) return refuse(), std::string_view();
    const std::string_view t = bytes.substr(0, n);
    bytes.remove_prefix(n);
    return t;
  }
  std::uint32_t refuse() {
    good = false;
    return 0;
  }
  /// An id above the one before (the first may be anything).
  std::uint32_t next_id(std::uint32_t last, bool first) {
    const std::uint32_t step = number();
    if ((!first && step == 0) || step > 0xffffffffu - last) refuse();
    return last + step;
  }
};

std::uint32_t zigzag(std::uint32_t to, std::uint32_t from) {
  const auto d = std::int32_t(to - from);
  return (std::uint32_t(d) << 1) ^ std::uint32_t(d >> 31);
}
std::uint32_t unzigzag(std::uint32_t code, std::uint32_t from) {
  return from + ((code >> 1) ^ (0u - (code & 1)));
}

}  // namespace

std::string encode(const RefineDelta& d) {
  Writer w;
  w.bytes = kMagic;
  w.plain(std::uint8_t(d.whole));
  w.plain(std::uint8_t(d.view.size()));
  w.bytes += d.view;
  w.plain(d.lon), w.plain(d.lat);
  for (const std::size_t n : {d.removed_triangles.size(), d.removed_vertices.size(),
                              d.vertices.size(), d.triangles.size()})
    w.number(std::uint32_t(n));
  w.ids(d.removed_triangles), w.ids(d.removed_vertices);
  std::uint32_t last = 0;
  for (const auto& v : d.vertices) {
    w.number(v.id - last), last = v.id;
    for (const float x : v.at) w.plain(x);
  }
  last = 0;
  std::uint32_t corner = 0;
  for (const auto& t : d.triangles) {
    w.number(t.id - last), last = t.id;
    for (const std::uint32_t c : t.corners) w.number(zigzag(c, corner)), corner = c;
  }
  return std::move(w.bytes);
}

std::expected<RefineDelta, std::string> decode_refine_delta(std::string_view bytes) {
  Reader r{bytes};
  if (r.text(4) != kMagic)
    return std::unexpected("not a refined mesh: it does not begin with TRF1");
  RefineDelta d;
  const auto flags = r.plain<std::uint8_t>();
  d.whole = flags & 1;
  d.view = r.text(r.plain<std::uint8_t>());
  d.lon = r.plain<double>(), d.lat = r.plain<double>();
  std::uint32_t counts[4];
  for (std::uint32_t& n : counts) n = r.number();
  for (int list = 0; list < 2; ++list) {
    auto& ids = list == 0 ? d.removed_triangles : d.removed_vertices;
    for (std::uint32_t i = 0, last = 0; r.good && i < counts[list]; ++i)
      ids.push_back(last = r.next_id(last, i == 0));
  }
  for (std::uint32_t i = 0, last = 0; r.good && i < counts[2]; ++i) {
    RefineDelta::Vertex v{last = r.next_id(last, i == 0), {}};
    for (float& x : v.at) x = r.plain<float>();
    d.vertices.push_back(v);
  }
  std::uint32_t corner = 0;
  for (std::uint32_t i = 0, last = 0; r.good && i < counts[3]; ++i) {
    RefineDelta::Triangle t{last = r.next_id(last, i == 0), {}};
    for (std::uint32_t& c : t.corners) c = corner = unzigzag(r.number(), corner);
    d.triangles.push_back(t);
  }
  if (!r.good || flags > 1) return std::unexpected("a refined mesh that is cut off or damaged");
  if (!r.bytes.empty()) return std::unexpected("bytes are left after a refined mesh");
  return d;
}

}  // namespace tind::proto
