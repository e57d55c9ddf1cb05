// A header, then objects; each has properties and elements, which are byte strings with their
// lengths. The lists come first, because triangles name places in them.

#include "proto/tile/btg.h"

#include <bit>
#include <cmath>
#include <string_view>

#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

constexpr std::uint32_t kMagic = 0x5347;  // "SG"
constexpr std::uint32_t kWide = 10;       // from this version on counts have four bytes
constexpr std::size_t kMostShort = 65535;

enum Kind : std::uint8_t {
  kSphere = 0,
  kVertices = 1,
  kNormals = 2,
  kTexcoords = 3,
  kTriangles = 10,
  kStrips = 11,
  kFans = 12
};
enum Property : std::uint8_t { kMaterial = 0, kIndexMask = 1 };
/// What a corner of a part has, in the order in which the numbers follow each other.
enum Mask : std::uint8_t { kHasVertex = 1, kHasNormal = 2, kHasColour = 4, kHasTexcoord = 8 };

class Encoder {
 public:
  explicit Encoder(const Btg& btg) : btg_(btg) {
    // Besides the lists' own, which are compared here, no count comes near.
    wide_ = btg.vertices.size() >= kMostShort || btg.normals.size() >= kMostShort ||
            btg.texcoords.size() >= kMostShort || 4 + btg.parts.size() >= kMostShort;
  }

  std::vector<std::uint8_t> encode() {
    put_.put(std::uint32_t(kMagic << 16 | (wide_ ? kWide : 7u)));
    put_.put(std::uint32_t(0));  // when: the same bytes whenever
    put_count(4 + btg_.parts.size());
    begin(kSphere, 0, 28);
    for (const double x : btg_.center) put_.put(x);
    put_.put(btg_.radius);
    put_list(kVertices, btg_.vertices);
    put_list(kNormals, btg_.normals);
    put_list(kTexcoords, btg_.texcoords);
    for (const Btg::Part& part : btg_.parts) put_part(part);
    return std::move(bytes_);
  }

 private:
  const Btg& btg_;
  bool wide_;
  std::vector<std::uint8_t> bytes_;
  ByteWriter<> put_{bytes_};

  void put_count(std::size_t n) { wide_ ? put_.put(std::uint32_t(n)) : put_.put(std::uint16_t(n)); }
  /// An object of one element, without properties; the element's bytes follow.
  void begin(Kind kind, std::size_t properties, std::size_t bytes) {
    put_.put(std::uint8_t(kind));
    put_count(properties);
    put_count(1);
    if (properties == 0) put_.put(std::uint32_t(bytes));
  }
  template <class T, std::size_t N>
  void put_list(Kind kind, const std::vector<std::array<T, N>>& list) {
    begin(kind, 0, list.size() * sizeof(T) * N);
    for (const auto& entry : list)
      for (const T x : entry) put_.put(x);
  }
  void put_property(Property property, std::string_view bytes) {
    put_.put(std::uint8_t(property));
    put_.put(std::uint32_t(bytes.size()));
    put_.put_text(bytes);
  }
  void put_part(const Btg::Part& part) {
    begin(kTriangles, 2, 0);
    put_property(kMaterial, part.material);
    const char mask = kHasVertex | kHasNormal | kHasTexcoord;
    put_property(kIndexMask, {&mask, 1});
    put_.put(std::uint32_t(part.triangles.size() * 9 * (wide_ ? 4 : 2)));
    for (const auto& triangle : part.triangles)
      for (const Btg::Corner& c : triangle)
        put_count(c.vertex), put_count(c.normal), put_count(c.texcoord);
  }
};

Error damaged(const std::string& what) { return {Errc::bad_data, "BTG: " + what}; }

class Decoder {
 public:
  explicit Decoder(std::span<const std::uint8_t> bytes) : in_(bytes) {}

  Result<Btg> decode() {
    const auto head = in_.get<std::uint32_t>();
    in_.get<std::uint32_t>();  // when
    if (!in_.good() || head >> 16 != kMagic)
      return std::unexpected(damaged("it does not begin as one (is it still packed?)"));
    const std::uint32_t version = head & 0xffff;
    if (version < 7 || version > kWide)
      return fail(Errc::unsupported, "BTG: version " + std::to_string(version) +
                                         "; this reads 7 to " + std::to_string(kWide));
    wide_ = version == kWide;
    for (std::uint32_t n = get_count(); n > 0; --n) {
      if (!in_.good()) break;
      if (const auto read = object(); !read) return std::unexpected(read.error());
    }
    if (!in_.good()) return std::unexpected(damaged("it ends before what it says is in it"));
    if (const auto sound = check(); !sound) return std::unexpected(sound.error());
    return std::move(btg_);
  }

 private:
  ByteReader in_;
  bool wide_ = false;
  Btg btg_;

  std::uint32_t get_count() { return wide_ ? in_.get<std::uint32_t>() : in_.get<std::uint16_t>(); }
  std::span<const std::uint8_t> get_bytes() { return in_.get_bytes(in_.get<std::uint32_t>()); }

  Result<void> object() {
    const auto kind = in_.get<std::uint8_t>();
    const std::uint32_t properties = get_count(), elements = get_count();
    const bool faces = kind == kTriangles || kind == kStrips || kind == kFans;
    std::uint8_t mask = kHasVertex | kHasTexcoord;
    Btg::Part part;
    for (std::uint32_t i = 0; i < properties && in_.good(); ++i) {
      const auto property = in_.get<std::uint8_t>();
      const auto bytes = get_bytes();
      if (property == kMaterial) part.material.assign(bytes.begin(), bytes.end());
      if (property == kIndexMask && bytes.size() == 1) mask = bytes[0];
    }
    if (faces && (mask & kHasVertex) == 0)
      return std::unexpected(damaged("a part whose corners have no vertex"));
    for (std::uint32_t i = 0; i < elements && in_.good(); ++i) {
      const auto bytes = get_bytes();
      if (faces)
        add_faces(Kind(kind), corners(bytes, mask), part);
      else
        add_list(kind, bytes);
    }
    if (!part.triangles.empty()) btg_.parts.push_back(std::move(part));
    return {};
  }

  void add_list(std::uint8_t kind, std::span<const std::uint8_t> bytes) {
    if (kind == kSphere && bytes.size() >= 28) {
      ByteReader in(bytes);
      for (double& x : btg_.center) x = in.get<double>();
      btg_.radius = in.get<float>();
    }
    if (kind == kVertices) append(bytes, btg_.vertices);
    if (kind == kNormals) append(bytes, btg_.normals);
    if (kind == kTexcoords) append(bytes, btg_.texcoords);
  }

  template <class T, std::size_t N>
  static void append(std::span<const std::uint8_t> bytes, std::vector<std::array<T, N>>& list) {
    ByteReader in(bytes);
    for (std::size_t n = bytes.size() / (sizeof(T) * N); n > 0; --n)
      for (T& x : list.emplace_back()) x = in.get<T>();
  }

  std::vector<Btg::Corner> corners(std::span<const std::uint8_t> bytes, std::uint8_t mask) const {
    const std::size_t each = std::size_t(std::popcount(mask)) * (wide_ ? 4 : 2);
    ByteReader in(bytes);
    std::vector<Btg::Corner> all(bytes.size() / each);
    for (Btg::Corner& c : all) {
      std::uint32_t numbers[8] = {};
      for (int bit = 0; bit < 8; ++bit)
        if (mask >> bit & 1)
          numbers[bit] = wide_ ? in.get<std::uint32_t>() : in.get<std::uint16_t>();
      c.vertex = numbers[0];
      c.normal = mask & kHasNormal ? numbers[1] : c.vertex;
      c.texcoord = mask & kHasTexcoord ? numbers[3] : c.vertex;
    }
    return all;
  }

  static void add_faces(Kind kind, const std::vector<Btg::Corner>& c, Btg::Part& part) {
    if (kind == kTriangles)
      for (std::size_t i = 2; i < c.size(); i += 3)
        part.triangles.push_back({c[i - 2], c[i - 1], c[i]});
    else
      for (std::size_t i = 2; i < c.size(); ++i) {
        const bool odd = kind == kStrips && i % 2 == 1;  // every other one runs the other way
        const Btg::Corner &a = kind == kFans ? c[0] : c[i - 2], &b = c[i - 1];
        part.triangles.push_back({odd ? b : a, odd ? a : b, c[i]});
      }
  }

  Result<void> check() const {
    for (const double x : btg_.center)
      if (!std::isfinite(x)) return std::unexpected(damaged("its centre is no place"));
    for (const auto& vertex : btg_.vertices)
      for (const float x : vertex)
        if (!std::isfinite(x)) return std::unexpected(damaged("a vertex is no place"));
    for (const Btg::Part& part : btg_.parts)
      for (const auto& triangle : part.triangles)
        for (const Btg::Corner& c : triangle)
          if (c.vertex >= btg_.vertices.size() || c.normal >= btg_.normals.size() ||
              c.texcoord >= btg_.texcoords.size())
            return std::unexpected(damaged("a corner names what is not there"));
    return {};
  }
};

}  // namespace

std::vector<std::uint8_t> encode(const Btg& btg) { return Encoder(btg).encode(); }

Result<Btg> decode_btg(std::span<const std::uint8_t> bytes) { return Decoder(bytes).decode(); }

}  // namespace tind::proto
