// Fixed fields, then variable-length numbers; checked against the bytes that are there before
// anything is reserved for them.

#include "proto/stream/mesh_stream_start.h"

#include <bit>
#include <cmath>

#include "terrain/base/bytes.h"

namespace tind::proto {

namespace {

constexpr std::size_t kHeader = 120;

constexpr int kLongest = 6;  // bytes of a signed number

std::vector<std::uint8_t> encode_base(const MeshStream& s) {
  std::vector<std::uint8_t> bytes;
  ByteWriter out(bytes);
  LatticePoint last{};
  for (const LatticePoint& p : s.base_vertices) {
    for (int k = 0; k < 3; ++k) out.put_signed_varint(std::int64_t(p[k]) - last[k]);
    last = p;
  }
  std::int64_t index = 0;
  for (const auto& t : s.base_triangles) {
    for (const std::uint32_t v : t) {
      out.put_signed_varint(std::int64_t(v) - index);
      index = v;
    }
  }
  return bytes;
}

std::string decode_base(ByteReader& in, MeshStream& s, std::size_t vertices,
                        std::size_t triangles) {
  std::array<std::int64_t, 3> p{};
  for (std::size_t i = 0; i < vertices && !in.ended(); ++i) {
    for (int k = 0; k < 3; ++k) {
      p[k] += in.get_signed_varint(kLongest);
      if (in.refused() || std::abs(p[k]) > largest_coordinate(s.frame, k))
        return "vertex " + std::to_string(i) + " of the base is out of range";
    }
    s.base_vertices.push_back({std::int32_t(p[0]), std::int32_t(p[1]), std::int32_t(p[2])});
  }
  std::int64_t index = 0;
  for (std::size_t i = 0; i < triangles && !in.ended(); ++i) {
    std::array<std::uint32_t, 3> t{};
    for (std::uint32_t& v : t) {
      index += in.get_signed_varint(kLongest);
      if (in.refused() || index < 0 || index >= std::int64_t(vertices))
        return "triangle " + std::to_string(i) + " of the base names a vertex that is not there";
      v = std::uint32_t(index);
    }
    const auto& b = s.base_vertices;
    if (s.frame == StreamFrame::terrain && orient(b[t[0]], b[t[1]], b[t[2]]) <= 0)
      return "triangle " + std::to_string(i) + " of the base is not counter-clockwise";
    s.base_triangles.push_back(t);
  }
  return {};
}

constexpr const char* kTooFew = "the bytes end before the base mesh does";

/// What version 1 has between the version and the numbers of vertices.
bool get_terrain(ByteReader& in, MeshStream& s) {
  s.per_post = in.get<std::uint16_t>();
  s.z_step_m = in.get<double>();
  s.fine_error_m = in.get<double>();
  s.cols = in.get<std::uint32_t>();
  s.rows = in.get<std::uint32_t>();
  for (double& a : s.post_to_crs) a = in.get<double>();
  s.z_unit_m = in.get<double>();
  s.datum = std::uint8_t(in.get<std::uint32_t>());
  return s.per_post >= 1 && s.per_post <= 1024 && std::has_single_bit(s.per_post) &&
         s.z_step_m > 0 && s.z_step_m < 1e6 && s.fine_error_m >= 0 && s.z_unit_m > 0 &&
         s.datum <= 2;
}

/// And version 2, in as many bytes.
bool get_space(ByteReader& in, MeshStream& s) {
  in.get<std::uint16_t>();  // reserved, as what follows below
  s.per_unit = in.get<double>();
  s.fine_error_m = in.get<double>();
  in.get<std::uint64_t>();
  bool fits = s.per_unit > 0 && s.per_unit <= 1e300 && s.fine_error_m >= 0;
  for (double& o : s.origin) {
    o = in.get<double>();
    fits = fits && std::abs(o) < 0x1p52 && o == std::floor(o);
  }
  for (int i = 0; i < 4; ++i) in.get<std::uint64_t>();
  in.get<std::uint32_t>();
  return fits;
}

void put_frame(ByteWriter<>& out, const MeshStream& s) {
  if (s.frame == StreamFrame::space) {
    out.put(std::uint16_t(0));
    out.put(s.per_unit);
    out.put(s.fine_error_m);
    out.put(std::uint64_t(0));
    for (const double o : s.origin) out.put(o);
    for (int i = 0; i < 4; ++i) out.put(std::uint64_t(0));
    out.put(std::uint32_t(0));
    return;
  }
  out.put(s.per_post);
  out.put(s.z_step_m);
  out.put(s.fine_error_m);
  out.put(s.cols);
  out.put(s.rows);
  for (const double a : s.post_to_crs) out.put(a);
  out.put(s.z_unit_m);
  out.put(std::uint32_t(s.datum));
}

}  // namespace

std::int64_t largest_coordinate(StreamFrame frame, int axis) {
  if (frame == StreamFrame::space) return kMostInSpace;
  return axis < 2 ? 1 << 29 : 1 << 30;
}

Result<std::size_t> decode_start(std::span<const std::uint8_t> bytes, MeshStream& s) {
  ByteReader in(bytes);
  if (in.get_text(4) != "TPM1") return fail(Errc::bad_data, "this is no .tpm stream");
  const auto version = in.get<std::uint16_t>();
  if (in.ended()) return fail(Errc::bad_data, kTooFew);
  if (version != 1 && version != 2)
    return fail(Errc::bad_data,
                "version " + std::to_string(version) + " of .tpm is not known here");
  s.frame = StreamFrame(version);
  const bool fits = s.frame == StreamFrame::space ? get_space(in, s) : get_terrain(in, s);
  const std::size_t vertices = in.get<std::uint32_t>(), triangles = in.get<std::uint32_t>();
  s.total_splits = in.get<std::uint32_t>();
  const std::size_t crs = in.get<std::uint32_t>(), base = in.get<std::uint32_t>();
  in.get<std::uint64_t>();  // reserved
  if (in.ended()) return fail(Errc::bad_data, kTooFew);
  if (!fits || vertices < 3 || triangles < 1 || vertices + std::size_t(s.total_splits) > ~0u)
    return fail(Errc::bad_data, "the header of the .tpm stream makes no sense");
  s.crs = in.get_text(crs);
  const std::size_t begin = in.at();
  if (in.ended() || in.left() < base) return fail(Errc::bad_data, kTooFew);
  if (vertices * 3 + triangles * 3 > base)
    return fail(Errc::bad_data, "the base mesh has more numbers than bytes");
  if (const std::string wrong = decode_base(in, s, vertices, triangles); !wrong.empty())
    return fail(Errc::bad_data, wrong);
  if (in.ended() || in.at() - begin != base)
    return fail(Errc::bad_data, "the base mesh is not as long as the header says");
  return in.at();
}

std::vector<std::uint8_t> encode_start(const MeshStream& s) {
  const std::vector<std::uint8_t> base = encode_base(s);
  std::vector<std::uint8_t> bytes;
  ByteWriter out(bytes);
  out.put_text("TPM1");
  out.put(std::uint16_t(s.frame));
  put_frame(out, s);
  out.put(std::uint32_t(s.base_vertices.size()));
  out.put(std::uint32_t(s.base_triangles.size()));
  out.put(s.total_splits);
  out.put(std::uint32_t(s.crs.size()));
  out.put(std::uint32_t(base.size()));
  out.put(std::uint64_t(0));
  static_assert(kHeader == 4 + 2 + 2 + 8 + 8 + 4 + 4 + 48 + 8 + 4 + 4 + 4 + 4 + 4 + 4 + 8);
  out.put_text(s.crs);
  out.put_bytes(base.data(), base.size());
  return bytes;
}

}  // namespace tind::proto
