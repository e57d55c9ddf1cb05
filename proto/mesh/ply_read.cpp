// PLY (Turk 1994): a text header that names elements and their properties, then their values as
// text or binary of either byte order.
//
// The body is read by one template over a source of scalars; each property of the header is
// resolved once to the place in the mesh where its values go. Counts of the header are believed
// only as far as the bytes reach.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <optional>
#include <vector>

#include "proto/mesh/mesh_io.h"
#include "proto/mesh/polygon.h"
#include "proto/text_put.h"
#include "proto/text_scan.h"
#include "terrain/base/bytes.h"

namespace tind::proto {
namespace {

enum class Type { i8, u8, i16, u16, i32, u32, f32, f64 };
constexpr std::size_t kTypeSize[] = {1, 1, 2, 2, 4, 4, 4, 8};

struct TypeName {
  std::string_view name;
  Type type;
};
constexpr TypeName kTypeNames[] = {
    {"char", Type::i8},   {"int8", Type::i8},     {"uchar", Type::u8},   {"uint8", Type::u8},
    {"short", Type::i16}, {"int16", Type::i16},   {"ushort", Type::u16}, {"uint16", Type::u16},
    {"int", Type::i32},   {"int32", Type::i32},   {"uint", Type::u32},   {"uint32", Type::u32},
    {"float", Type::f32}, {"float32", Type::f32}, {"double", Type::f64}, {"float64", Type::f64}};

/// Where a vertex property goes.
enum Slot { kX, kY, kZ, kNx, kNy, kNz, kRed, kGreen, kBlue, kS, kT, kSlots, kIgnored = kSlots };

struct SlotName {
  std::string_view name;
  Slot slot;
};
constexpr SlotName kSlotNames[] = {{"x", kX},
                                   {"y", kY},
                                   {"z", kZ},
                                   {"nx", kNx},
                                   {"ny", kNy},
                                   {"nz", kNz},
                                   {"red", kRed},
                                   {"green", kGreen},
                                   {"blue", kBlue},
                                   {"r", kRed},
                                   {"g", kGreen},
                                   {"b", kBlue},
                                   {"s", kS},
                                   {"t", kT},
                                   {"u", kS},
                                   {"v", kT},
                                   {"texture_u", kS},
                                   {"texture_v", kT},
                                   {"diffuse_red", kRed},
                                   {"diffuse_green", kGreen},
                                   {"diffuse_blue", kBlue}};

struct Property {
  std::string_view name;
  Type type = Type::f32;
  std::optional<Type> count;  // of a list
};

struct Element {
  std::string_view name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { ascii, little, big };

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::string texture;
  MeshPlace place;
  std::size_t size = 0, lines = 0;
};

std::unexpected<Error> bad(std::string why) { return fail(Errc::bad_data, std::move(why)); }

std::unexpected<Error> bad_line(std::size_t line, const std::string& why) {
  return bad("PLY line " + std::to_string(line) + ": " + why);
}

std::optional<Type> type_named(std::string_view name) {
  const auto it = std::ranges::find(kTypeNames, name, &TypeName::name);
  if (it == std::end(kTypeNames)) return std::nullopt;
  return it->type;
}

std::optional<Property> parse_property(std::string_view rest) {
  Property p;
  std::string_view word = text::take_word(rest);
  if (word == "list") {
    p.count = type_named(text::take_word(rest));
    if (!p.count || *p.count == Type::f32 || *p.count == Type::f64) return std::nullopt;
    word = text::take_word(rest);
  }
  const auto type = type_named(word);
  p.name = text::take_word(rest);
  if (!type || p.name.empty()) return std::nullopt;
  p.type = *type;
  return p;
}

/// One header line; the reason when it makes no sense.
std::string parse_header_line(std::string_view line, Header& header) {
  std::string_view rest = line;
  const std::string_view word = text::take_word(rest);
  if (word == "format") {
    const std::string_view name = text::take_word(rest);
    if (name == "ascii")
      header.encoding = Encoding::ascii;
    else if (name == "binary_little_endian")
      header.encoding = Encoding::little;
    else if (name == "binary_big_endian")
      header.encoding = Encoding::big;
    else
      return "unknown format " + std::string(name);
  } else if (word == "element") {
    Element element;
    element.name = text::take_word(rest);
    if (!text::parse(text::take_word(rest), element.count)) return "an element without a count";
    header.elements.push_back(element);
  } else if (word == "property") {
    const auto property = parse_property(rest);
    if (!property || header.elements.empty()) return "not a property";
    header.elements.back().properties.push_back(*property);
  } else if (word == "comment") {
    read_place_line(rest, header.place);
    if (text::take_word(rest) == "TextureFile") header.texture = text::trim(rest);
  } else if (word != "obj_info" && !word.empty()) {
    return "unknown header word " + std::string(word.substr(0, 40));
  }
  return {};
}

Result<Header> parse_header(std::string_view bytes) {
  if (!bytes.starts_with("ply\n") && !bytes.starts_with("ply\r\n"))
    return bad("not a PLY file: it does not begin with \"ply\"");
  Header header;
  bool has_format = false;
  while (header.size < bytes.size()) {
    const std::size_t end = bytes.find('\n', header.size);
    if (end == bytes.npos) break;
    const std::string_view line = text::trim(bytes.substr(header.size, end - header.size));
    header.size = end + 1;
    ++header.lines;
    if (header.lines == 1) continue;
    if (line == "end_header") {
      if (!has_format) return bad_line(header.lines, "the header names no format");
      return header;
    }
    has_format |= line.starts_with("format");
    if (const std::string why = parse_header_line(line, header); !why.empty())
      return bad_line(header.lines, why);
  }
  return bad("PLY: the header has no end_header");
}

// ---- sources of scalars ----

class Ascii {
 public:
  Ascii(std::string_view bytes, const Header& header)
      : all_(bytes), rest_(bytes.substr(header.size)) {}

  bool scalar(Type, double& out) { return text::parse(text::take_word(rest_), out); }
  std::size_t left() const { return rest_.size(); }
  std::string place() const {
    const std::size_t read = all_.size() - rest_.size();
    return "line " + std::to_string(1 + std::count(all_.begin(), all_.begin() + long(read), '\n'));
  }

 private:
  std::string_view all_, rest_;
};

template <std::endian Order>
class Binary {
 public:
  Binary(std::string_view bytes, const Header& header) : bytes_(bytes), at_(header.size) {}

  bool scalar(Type type, double& out) {
    if (left() < kTypeSize[int(type)]) return false;
    switch (type) {
      case Type::i8:
        out = load<std::int8_t>();
        break;
      case Type::u8:
        out = load<std::uint8_t>();
        break;
      case Type::i16:
        out = load<std::int16_t>();
        break;
      case Type::u16:
        out = load<std::uint16_t>();
        break;
      case Type::i32:
        out = load<std::int32_t>();
        break;
      case Type::u32:
        out = load<std::uint32_t>();
        break;
      case Type::f32:
        out = double(load<float>());
        break;
      case Type::f64:
        out = load<double>();
        break;
    }
    return true;
  }
  std::size_t left() const { return bytes_.size() - at_; }
  std::string place() const { return "byte " + std::to_string(at_); }

 private:
  template <class T>
  T load() {
    const T value = tind::load<T, Order>(bytes_.data() + at_);
    at_ += sizeof(T);
    return value;
  }

  std::string_view bytes_;
  std::size_t at_;
};

// ---- the body ----

template <class Source>
class Body {
 public:
  Body(Source source, Mesh& mesh) : source_(source), mesh_(mesh) {}

  bool read(const Header& header) {
    return std::ranges::all_of(header.elements, [&](const Element& e) { return element(e); });
  }
  std::string why() const { return "PLY " + source_.place() + ": " + why_; }

 private:
  bool reject(std::string why) {
    why_ = std::move(why);
    return false;
  }

  bool element(const Element& e) {
    if (e.properties.empty()) return true;
    if (e.count > source_.left())  // every value takes a byte at least
      return reject("truncated: the header promises " + std::to_string(e.count) + " of element " +
                    std::string(e.name));
    if (e.name == "vertex") return vertices(e);
    for (std::uint64_t i = 0; i < e.count; ++i)
      for (const Property& p : e.properties)
        if (!other(e, p)) return false;
    return true;
  }

  struct Target {
    Slot slot = kIgnored;
    double scale = 1;
  };

  /// Integers that go to a colour become 0..1.
  static Target target(const Property& p) {
    const auto it = std::ranges::find(kSlotNames, p.name, &SlotName::name);
    if (it == std::end(kSlotNames) || p.count) return {};
    const bool colour = it->slot >= kRed && it->slot <= kBlue;
    if (colour && p.type == Type::u8) return {it->slot, 1 / 255.0};
    if (colour && p.type == Type::u16) return {it->slot, 1 / 65535.0};
    return {it->slot, 1};
  }

  bool vertices(const Element& e) {
    std::vector<Target> targets;
    std::array<bool, kSlots> has{};
    for (const Property& p : e.properties) {
      targets.push_back(target(p));
      if (targets.back().slot != kIgnored) has[targets.back().slot] = true;
    }
    if (!has[kX] || !has[kY] || !has[kZ]) return reject("the vertices have no x, y, z");
    std::array<double, kSlots + 1> values{};
    for (std::uint64_t i = 0; i < e.count; ++i) {
      for (std::size_t k = 0; k < targets.size(); ++k)
        if (!value(e.properties[k], targets[k], values[targets[k].slot])) return false;
      if (!std::isfinite(values[kX]) || !std::isfinite(values[kY]) || !std::isfinite(values[kZ]))
        return reject("vertex " + std::to_string(i) + " is not finite");
      for (std::size_t k = kNx; k < kSlots; ++k)
        if (has[k] && !std::isfinite(narrow(values[k])))
          return reject("an attribute of vertex " + std::to_string(i) + " is not finite");
      store(values, has);
    }
    return true;
  }

  static float narrow(double x) { return float(x); }

  void store(const std::array<double, kSlots + 1>& v, const std::array<bool, kSlots>& has) {
    mesh_.positions.push_back({v[kX], v[kY], v[kZ]});
    if (has[kNx] && has[kNy] && has[kNz])
      mesh_.normals.push_back({narrow(v[kNx]), narrow(v[kNy]), narrow(v[kNz])});
    if (has[kRed] && has[kGreen] && has[kBlue])
      mesh_.colours.push_back({narrow(v[kRed]), narrow(v[kGreen]), narrow(v[kBlue])});
    if (has[kS] && has[kT]) mesh_.texcoords.push_back({narrow(v[kS]), narrow(v[kT])});
  }

  bool value(const Property& p, const Target& where, double& out) {
    if (p.count) return list(p, [](double) {});
    if (!source_.scalar(p.type, out)) return truncated();
    out *= where.scale;
    return true;
  }

  bool other(const Element& e, const Property& p) {
    double ignored = 0;
    if (!p.count) return source_.scalar(p.type, ignored) || truncated();
    polygon_.clear();
    if (!list(p, [&](double index) { polygon_.push_back(index); })) return false;
    const bool indices = p.name == "vertex_indices" || p.name == "vertex_index";
    if (indices && e.name == "face") return face();
    if (indices && e.name == "tristrips") return strip();
    return true;
  }

  template <class Each>
  bool list(const Property& p, Each&& each) {
    double count = 0, entry = 0;
    if (!source_.scalar(*p.count, count)) return truncated();
    if (!(count >= 0) || count > double(source_.left())) {
      std::string why = "a list of ";
      text::put_text(why, count);
      return reject(why + " values is not there");
    }
    for (std::uint64_t i = 0; i < std::uint64_t(count); ++i) {
      if (!source_.scalar(p.type, entry)) return truncated();
      each(entry);
    }
    return true;
  }

  bool triangle(double a, double b, double c) {
    for (const double i : {a, b, c})
      if (!(i >= 0) || i >= 4294967295.0 || i != std::floor(i))
        return reject("a face names a vertex that is not there");
    mesh_.triangles.push_back({std::uint32_t(a), std::uint32_t(b), std::uint32_t(c)});
    return true;
  }

  bool face() {
    if (polygon_.size() < 3) return reject("a face needs three corners");
    bool good = true;
    each_triangle_of(polygon_.size(), [&](std::size_t a, std::size_t b, std::size_t c) {
      good = good && triangle(polygon_[a], polygon_[b], polygon_[c]);
    });
    return good;
  }

  /// -1 starts a new strip; every second triangle turns the other way.
  bool strip() {
    std::size_t begin = 0;
    for (std::size_t i = 0; i < polygon_.size(); ++i) {
      if (polygon_[i] == -1) begin = i + 1;
      if (i < begin + 2) continue;
      const double a = polygon_[i - 2], b = polygon_[i - 1], c = polygon_[i];
      if (a == b || b == c || a == c) continue;
      if (!((i - begin) % 2 == 0 ? triangle(a, b, c) : triangle(b, a, c))) return false;
    }
    return true;
  }

  bool truncated() { return reject("truncated or not a number"); }

  Source source_;
  Mesh& mesh_;
  std::vector<double> polygon_;
  std::string why_;
};

template <class Source>
Result<Mesh> read_body(std::string_view bytes, Header& header) {
  Mesh mesh;
  mesh.texture = std::move(header.texture);
  mesh.place = std::move(header.place);
  Body<Source> body(Source(bytes, header), mesh);
  if (!body.read(header)) return bad(body.why());
  for (const auto& triangle : mesh.triangles)  // faces may come before the vertices
    for (const std::uint32_t index : triangle)
      if (index >= mesh.positions.size())
        return bad("PLY: a face names vertex " + std::to_string(index) + " of " +
                   std::to_string(mesh.positions.size()));
  return mesh;
}

}  // namespace

Result<Mesh> decode_ply(std::string_view bytes) {
  auto header = parse_header(bytes);
  if (!header) return std::unexpected(header.error());
  const auto vertex = std::ranges::count(header->elements, "vertex", &Element::name);
  if (vertex != 1)
    return bad("PLY: the header names " + std::to_string(vertex) +
               " vertex elements instead of one");
  switch (header->encoding) {
    case Encoding::ascii:
      return read_body<Ascii>(bytes, *header);
    case Encoding::little:
      return read_body<Binary<std::endian::little>>(bytes, *header);
    case Encoding::big:
      return read_body<Binary<std::endian::big>>(bytes, *header);
  }
  return bad("PLY: unknown format");
}

std::string texture_of_ply(std::string_view bytes) {
  auto header = parse_header(bytes);
  return header ? std::move(header->texture) : std::string();
}

}  // namespace tind::proto
