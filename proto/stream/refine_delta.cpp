// "TRF1", flags, token, place, four counts, then the four lists. Numbers are LEB128 varints; ids
// are differences from the one before, corners zig-zag differences from the corner before.

#include "proto/stream/refine_delta.h"

#include "terrain/base/bytes.h"

namespace tind::proto {

namespace {

constexpr std::string_view kMagic = "TRF1";

using Writer = ByteWriter<std::string>;

void put_ids(Writer& out, const std::vector<std::uint32_t>& list) {
  std::uint32_t last = 0;
  for (const std::uint32_t id : list) out.put_varint(id - last), last = id;
}

std::uint32_t get_number(ByteReader& in) {
  const std::uint64_t v = in.get_varint();
  if (v > 0xffffffffu) in.refuse();
  return std::uint32_t(v);
}

/// An id above the one before (the first may be anything).
std::uint32_t next_id(ByteReader& in, std::uint32_t last, bool first) {
  const std::uint32_t step = get_number(in);
  if ((!first && step == 0) || step > 0xffffffffu - last) in.refuse();
  return last + step;
}

/// Differences of corners, modulo 2^32.
std::uint32_t corner_code(std::uint32_t to, std::uint32_t from) {
  return std::uint32_t(zigzag(std::int32_t(to - from)));
}
std::uint32_t corner_of(std::uint32_t code, std::uint32_t from) {
  return from + std::uint32_t(unzigzag(code));
}

}  // namespace

std::string encode(const RefineDelta& d) {
  std::string bytes;
  Writer out(bytes);
  out.put_text(kMagic);
  out.put(std::uint8_t(d.whole));
  out.put(std::uint8_t(d.view.size()));
  out.put_text(d.view);
  out.put(d.lon), out.put(d.lat);
  for (const std::size_t n : {d.removed_triangles.size(), d.removed_vertices.size(),
                              d.vertices.size(), d.triangles.size()})
    out.put_varint(std::uint32_t(n));
  put_ids(out, d.removed_triangles), put_ids(out, d.removed_vertices);
  std::uint32_t last = 0;
  for (const auto& v : d.vertices) {
    out.put_varint(v.id - last), last = v.id;
    for (const float x : v.at) out.put(x);
  }
  last = 0;
  std::uint32_t corner = 0;
  for (const auto& t : d.triangles) {
    out.put_varint(t.id - last), last = t.id;
    for (const std::uint32_t c : t.corners) out.put_varint(corner_code(c, corner)), corner = c;
  }
  return bytes;
}

Result<RefineDelta> decode_refine_delta(std::string_view bytes) {
  ByteReader in(bytes);
  if (in.get_text(4) != kMagic)
    return fail(Errc::bad_data, "not a refined mesh: it does not begin with TRF1");
  RefineDelta d;
  const auto flags = in.get<std::uint8_t>();
  d.whole = flags & 1;
  d.view = in.get_text(in.get<std::uint8_t>());
  d.lon = in.get<double>(), d.lat = in.get<double>();
  std::uint32_t counts[4];
  for (std::uint32_t& n : counts) n = get_number(in);
  for (int list = 0; list < 2; ++list) {
    auto& ids = list == 0 ? d.removed_triangles : d.removed_vertices;
    for (std::uint32_t i = 0, last = 0; in.good() && i < counts[list]; ++i)
      ids.push_back(last = next_id(in, last, i == 0));
  }
  for (std::uint32_t i = 0, last = 0; in.good() && i < counts[2]; ++i) {
    RefineDelta::Vertex v{last = next_id(in, last, i == 0), {}};
    for (float& x : v.at) x = in.get<float>();
    d.vertices.push_back(v);
  }
  std::uint32_t corner = 0;
  for (std::uint32_t i = 0, last = 0; in.good() && i < counts[3]; ++i) {
    RefineDelta::Triangle t{last = next_id(in, last, i == 0), {}};
    for (std::uint32_t& c : t.corners) c = corner = corner_of(get_number(in), corner);
    d.triangles.push_back(t);
  }
  if (!in.good() || flags > 1)
    return fail(Errc::bad_data, "a refined mesh that is cut off or damaged");
  if (in.left() > 0) return fail(Errc::bad_data, "bytes are left after a refined mesh");
  return d;
}

}  // namespace tind::proto
