// glTF 2.0 (ISO/IEC 12113), read as its text says and not as tind writes it: chapter 4 for GLB,
// sections 3.6 and 3.7 for buffers, accessors and primitives.
//
// A number that is there must be right. Only one that is not there has its default.

#include "terrain/check/check_glb.h"

#include <array>
#include <cstdint>
#include <optional>

#include "proto/json_member.h"
#include "proto/json_text.h"
#include "terrain/base/bytes.h"

namespace tind {
namespace {

using Json = nlohmann::json;

constexpr std::int64_t kMost = 1ll << 40;
constexpr std::size_t kMostValues = 4'000'000;  // of JSON; each takes up to 100 bytes

struct Glb {
  Json json;
  std::string_view binary;  // of its chunk
};

/// What is wrong, or nothing and its parts.
std::string open_glb(std::string_view bytes, Glb& glb) {
  if (bytes.size() < 20 || load<std::uint32_t>(bytes.data()) != 0x46546c67) return "is no GLB";
  if (load<std::uint32_t>(&bytes[4]) != 2) return "is not of glTF 2";
  if (load<std::uint32_t>(&bytes[8]) != bytes.size())
    return "says that it has " + std::to_string(load<std::uint32_t>(&bytes[8])) + " bytes, not " +
           std::to_string(bytes.size());
  std::size_t at = 12;
  for (int chunk = 0; at < bytes.size(); ++chunk) {
    if (bytes.size() - at < 8) return "ends inside a chunk";
    const std::uint32_t size = load<std::uint32_t>(&bytes[at]);
    const std::uint32_t kind = load<std::uint32_t>(&bytes[at + 4]);
    if (size > bytes.size() - at - 8) return "ends inside a chunk";
    const std::string_view content = bytes.substr(at + 8, size);
    if (chunk == 0 && kind != 0x4e4f534a) return "does not begin with JSON";
    if (chunk == 0 && json::count_values(content) > kMostValues)
      return "has more than " + std::to_string(kMostValues) + " JSON values";
    if (chunk == 0) glb.json = json::parse<Json>(content);
    if (chunk == 1 && kind == 0x004e4942) glb.binary = content;
    at += 8 + std::size_t(size);
  }
  return glb.json.is_object() ? "" : "its JSON is damaged";
}

const Json& list(const Json& object, const char* name) {
  static const Json kNone = Json::array();
  const Json* const found = json::member(object, name);
  return found && found->is_array() ? *found : kNone;
}

std::int64_t component_bytes(std::int64_t type) {
  return type == 5120 || type == 5121   ? 1
         : type == 5122 || type == 5123 ? 2
         : type == 5125 || type == 5126 ? 4
                                        : 0;
}

std::int64_t components_of(const std::string& type) {
  constexpr std::pair<std::string_view, int> kAll[] = {
      {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};
  for (const auto& [name, n] : kAll)
    if (name == type) return n;
  return 0;
}

/// The element of a list that a member names by its number.
const Json* named_in(const Json& all, const Json& object, const char* name) {
  const auto i = json::whole(object, name, 0, std::int64_t(all.size()) - 1);
  return i ? &all[std::size_t(*i)] : nullptr;
}

/// The parts of one GLB, which name each other by number.
class Parts {
 public:
  explicit Parts(const Glb& glb)
      : glb_(glb),
        buffers_(list(glb.json, "buffers")),
        views_(list(glb.json, "bufferViews")),
        accessors_(list(glb.json, "accessors")) {}

  std::string wrong() const {
    for (const auto& [what, all, wrong_of] :
         {std::tuple{"buffer ", &buffers_, &Parts::wrong_buffer},
          {"buffer view ", &views_, &Parts::wrong_view},
          {"accessor ", &accessors_, &Parts::wrong_accessor},
          {"mesh ", &list(glb_.json, "meshes"), &Parts::wrong_mesh}})
      for (std::size_t i = 0; i < all->size(); ++i)
        if (const std::string why = (this->*wrong_of)((*all)[i], i == 0); !why.empty())
          return what + std::to_string(i) + " " + why;
    return {};
  }

 private:
  const Glb& glb_;
  const Json &buffers_, &views_, &accessors_;

  /// The first buffer without a place of its own is the binary chunk.
  bool is_chunk(const Json& buffer) const {
    return !buffers_.empty() && &buffer == &buffers_[0] && !json::member(buffer, "uri") &&
           !json::member(buffer, "extensions");
  }

  std::string wrong_buffer(const Json& b, bool) const {
    const auto size = json::whole(b, "byteLength", 1, kMost);
    if (!size) return "has no length";
    return is_chunk(b) && std::uint64_t(*size) > glb_.binary.size() ? "ends behind the file" : "";
  }

  /// Also of the bytes that a compressed view stands for.
  std::string wrong_place(const Json& v) const {
    const Json* const buffer = named_in(buffers_, v, "buffer");
    const auto offset = json::whole_or(v, "byteOffset", 0, 0, kMost);
    const auto size = json::whole(v, "byteLength", 1, kMost);
    const bool inside = buffer && offset && size &&
                        *offset + *size <= json::whole(*buffer, "byteLength").value_or(0);
    return inside ? "" : "lies in no buffer";
  }

  std::string wrong_view(const Json& v, bool) const {
    if (auto wrong = wrong_place(v); !wrong.empty()) return wrong;
    const auto stride = json::whole_or(v, "byteStride", 4, 4, 252);
    if (!stride || *stride % 4 != 0) return "has a byteStride that is none of 4, 8 ... 252";
    if (const Json* const all = json::member(v, "extensions"))
      if (const Json* const packed = json::member(*all, "EXT_meshopt_compression"))
        return wrong_place(*packed);
    return {};
  }

  std::string wrong_accessor(const Json& a, bool) const {
    const std::int64_t component = component_bytes(json::whole(a, "componentType").value_or(0));
    const std::int64_t each = component * components_of(json::text(a, "type").value_or(""));
    const auto count = json::whole(a, "count", 1, kMost);
    if (each == 0 || !count) return "has no type or count";
    const auto offset = json::whole_or(a, "byteOffset", 0, 0, kMost);
    if (!offset) return "has a byteOffset that is no place";
    if (!json::member(a, "bufferView")) return {};  // zeros, or packed by an extension
    const Json* const v = named_in(views_, a, "bufferView");
    if (!v) return "lies in no buffer view";
    const std::int64_t stride = *json::whole_or(*v, "byteStride", each, 4, 252);
    if (stride < each) return "has elements longer than its buffer view's byteStride";
    if ((*offset + *json::whole_or(*v, "byteOffset", 0, 0, kMost)) % component != 0)
      return "does not begin at a multiple of its components' size";
    return *count > kMost / 256 ||
                   *offset + stride * (*count - 1) + each > *json::whole(*v, "byteLength")
               ? "goes beyond its buffer view"
               : "";
  }

  std::string wrong_mesh(const Json& mesh, bool) const {
    const Json& primitives = list(mesh, "primitives");
    if (primitives.empty()) return "has no primitives";
    for (const Json& p : primitives)
      if (auto wrong = wrong_primitive(p); !wrong.empty()) return "has a primitive that " + wrong;
    return {};
  }

  std::string wrong_primitive(const Json& p) const {
    const Json* const attributes = json::member(p, "attributes");
    if (!attributes || !attributes->is_object() || attributes->empty()) return "has no attributes";
    std::int64_t vertices = -1;
    for (const auto& [name, number] : attributes->items()) {
      const Json* const accessor = named_in(accessors_, *attributes, name.c_str());
      if (!accessor) return "has an attribute in no accessor";
      const std::int64_t count = *json::whole(*accessor, "count");
      if (vertices >= 0 && count != vertices) return "has attributes of different numbers";
      vertices = count;
    }
    if (!json::whole_or(p, "mode", 4, 0, 6)) return "has a mode that there is not";
    if (json::member(p, "material") && !named_in(list(glb_.json, "materials"), p, "material"))
      return "has a material that there is not";
    if (!json::member(p, "indices")) return {};
    const Json* const indices = named_in(accessors_, p, "indices");
    if (!indices) return "has indices in no accessor";
    const std::int64_t type = *json::whole(*indices, "componentType");
    if (json::text(*indices, "type") != "SCALAR" || (type != 5121 && type != 5123 && type != 5125))
      return "has indices that are no whole numbers";
    return wrong_indices(*indices, component_bytes(type), vertices);
  }

  /// Where they lie in the file as they are.
  std::string wrong_indices(const Json& a, std::int64_t component, std::int64_t vertices) const {
    const Json* const v = named_in(views_, a, "bufferView");
    if (!v || json::member(*v, "extensions") || json::member(a, "sparse")) return {};
    const Json* const buffer = named_in(buffers_, *v, "buffer");
    if (!buffer || !is_chunk(*buffer)) return {};
    const std::int64_t stride = *json::whole_or(*v, "byteStride", component, 4, 252);
    const char* at = glb_.binary.data() + *json::whole_or(*v, "byteOffset", 0, 0, kMost) +
                     *json::whole_or(a, "byteOffset", 0, 0, kMost);
    for (std::int64_t i = *json::whole(a, "count"); i > 0; --i, at += stride) {
      const std::uint32_t index = component == 1   ? std::uint8_t(*at)
                                  : component == 2 ? load<std::uint16_t>(at)
                                                   : load<std::uint32_t>(at);
      if (index >= vertices)
        return "has the index " + std::to_string(index) + " of " + std::to_string(vertices) +
               " vertices";
    }
    return {};
  }
};

}  // namespace

std::string wrong_with_glb(std::string_view bytes) {
  Glb glb;
  if (auto wrong = open_glb(bytes, glb); !wrong.empty()) return wrong;
  const auto version = json::member(glb.json, "asset");
  if (!version || json::text(*version, "version").value_or("") != "2.0")
    return "says no version 2.0 of glTF";
  return Parts(glb).wrong();
}

std::string glb_compression(std::string_view bytes) {
  Glb glb;
  if (!open_glb(bytes, glb).empty()) return "none";
  for (const Json& used : list(glb.json, "extensionsUsed")) {
    if (used == "EXT_meshopt_compression") return "meshopt";
    if (used == "KHR_draco_mesh_compression") return "draco";
  }
  return "none";
}

}  // namespace tind
