// Wavefront OBJ, the polygonal part (v vt vn f mtllib usemtl); everything else is read over.
//
// OBJ indexes positions, texture coordinates and normals separately; Mesh has one index. A position
// keeps its number for the first combination it is used in, further combinations are appended, so a
// file without seams keeps its vertices one to one.

#include <algorithm>
#include <cmath>
#include <span>
#include <unordered_map>

#include "proto/mesh/mesh_io.h"
#include "proto/mesh/polygon.h"
#include "proto/text_scan.h"
#include "terrain/base/keyed_hash.h"

namespace tind::proto {
namespace {

constexpr std::uint32_t kNone = ~std::uint32_t(0);

/// One corner of a face: indices from 0, kNone where not given.
struct Corner {
  std::uint32_t v = kNone, vt = kNone, vn = kNone;
  friend bool operator==(const Corner&, const Corner&) = default;
};

struct CornerHash {
  std::size_t operator()(const Corner& c) const {
    return std::size_t(keyed_hash(keyed_hash(keyed_hash(c.v) ^ c.vt) ^ c.vn));
  }
};

class ObjReader {
 public:
  Result<Mesh> read(std::string_view bytes) {
    text::Lines lines(bytes, text::Lines::Join::at_backslash);
    for (std::string_view line; lines.next(line);)
      if (!statement(line))
        return fail(Errc::bad_data, "OBJ line " + std::to_string(lines.number()) + ": " + why_);
    fill_attributes();
    return std::move(mesh_);
  }

 private:
  bool reject(std::string why) {
    why_ = std::move(why);
    return false;
  }

  bool statement(std::string_view line) {
    if (line.starts_with('#')) read_place_line(line.substr(1), mesh_.place);
    if (const auto comment = line.find('#'); comment != line.npos) line = line.substr(0, comment);
    const std::string_view word = text::take_word(line);
    if (word == "v") return vertex(line);
    if (word == "vt") return texcoord(line);
    if (word == "vn") return normal(line);
    if (word == "f") return face(line);
    if (word == "mtllib") remember(mesh_.material_libraries, text::trim(line));
    if (word == "usemtl") remember(mesh_.materials, text::trim(line));
    return true;
  }

  static void remember(std::vector<std::string>& names, std::string_view name) {
    // Only the last few are compared: a hostile file with a million names must not take a day.
    constexpr std::size_t kCompared = 64;
    const std::size_t from = names.size() > kCompared ? names.size() - kCompared : 0;
    if (std::find(names.begin() + long(from), names.end(), name) == names.end())
      names.emplace_back(name);
  }

  /// Up to `most` numbers; how many, or 0 when one of them is no finite number.
  static std::size_t numbers(std::string_view rest, double* out, std::size_t most) {
    std::size_t count = 0;
    while (count < most) {
      const std::string_view word = text::take_word(rest);
      if (word.empty()) break;
      if (!text::parse_finite(word, out[count++])) return 0;
    }
    return count;
  }

  /// Attributes are floats.
  static bool are_floats(std::span<const double> all) {
    return std::ranges::all_of(all, [](double x) { return std::isfinite(float(x)); });
  }

  bool vertex(std::string_view rest) {
    double n[7];
    const std::size_t count = numbers(rest, n, 7);
    if (count < 3) return reject("v needs three finite numbers");
    if (mesh_.positions.size() >= kSplit) return reject("too many vertices");
    mesh_.positions.push_back({n[0], n[1], n[2]});
    if (count >= 6) {
      if (!are_floats({n + 3, 3})) return reject("v needs a colour of finite numbers");
      mesh_.colours.resize(mesh_.positions.size() - 1, {1, 1, 1});
      mesh_.colours.push_back({float(n[3]), float(n[4]), float(n[5])});
    }
    return true;
  }

  bool texcoord(std::string_view rest) {
    double n[3] = {};
    if (numbers(rest, n, 3) < 1 || !are_floats(n)) return reject("vt needs finite numbers");
    texcoords_.push_back({float(n[0]), float(n[1])});
    return true;
  }

  bool normal(std::string_view rest) {
    double n[3];
    if (numbers(rest, n, 3) < 3 || !are_floats(n)) return reject("vn needs three finite numbers");
    normals_.push_back({float(n[0]), float(n[1]), float(n[2])});
    return true;
  }

  /// 1.. counts from the first, -1.. from the last read so far.
  static bool resolve(std::string_view word, std::size_t count, std::uint32_t& out) {
    std::int64_t index;
    if (!text::parse(word, index)) return false;
    if (index < 0)
      index += std::int64_t(count);
    else
      --index;
    if (index < 0 || index >= std::int64_t(count)) return false;
    out = std::uint32_t(index);
    return true;
  }

  bool corner(std::string_view word, Corner& c) {
    const std::size_t first = std::min(word.find('/'), word.size());
    const std::size_t second = std::min(word.find('/', first + 1), word.size());
    if (!resolve(word.substr(0, first), positions_read(), c.v)) return false;
    if (second > first + 1)
      if (!resolve(word.substr(first + 1, second - first - 1), texcoords_.size(), c.vt))
        return false;
    if (second + 1 < word.size())
      if (!resolve(word.substr(second + 1), normals_.size(), c.vn)) return false;
    return true;
  }

  bool face(std::string_view rest) {
    polygon_.clear();
    for (;;) {
      const std::string_view word = text::take_word(rest);
      if (word.empty()) break;
      Corner c;
      if (!corner(word, c))
        return reject("f names something that is not there: " + std::string(word.substr(0, 40)));
      polygon_.push_back(vertex_of(c));
    }
    if (polygon_.size() < 3) return reject("f needs three corners");
    each_triangle_of(polygon_.size(), [this](std::size_t a, std::size_t b, std::size_t c) {
      mesh_.triangles.push_back({polygon_[a], polygon_[b], polygon_[c]});
    });
    return true;
  }

  std::size_t positions_read() const { return mesh_.positions.size(); }

  /// Split vertices are marked by the top bit while positions may still follow.
  std::uint32_t vertex_of(const Corner& c) {
    if (first_use_.size() <= c.v) first_use_.resize(positions_read());
    Corner& first = first_use_[c.v];
    if (first.v == kNone) first = c;
    if (first == c) return c.v;
    const auto [it, is_new] = split_.try_emplace(c, std::uint32_t(splits_.size()));
    if (is_new) splits_.push_back(c);
    return kSplit | it->second;
  }

  void fill_attributes() {
    const std::size_t original = mesh_.positions.size();
    if (!mesh_.colours.empty()) mesh_.colours.resize(original, {1, 1, 1});
    first_use_.resize(original);
    for (const Corner& c : splits_) {
      mesh_.positions.push_back(mesh_.positions[c.v]);
      if (!mesh_.colours.empty()) mesh_.colours.push_back(mesh_.colours[c.v]);
    }
    for (auto& triangle : mesh_.triangles)
      for (std::uint32_t& index : triangle)
        if (index & kSplit) index = std::uint32_t(original) + (index & ~kSplit);
    first_use_.insert(first_use_.end(), splits_.begin(), splits_.end());
    if (std::ranges::any_of(first_use_, [](const Corner& c) { return c.vt != kNone; }))
      for (const Corner& c : first_use_)
        mesh_.texcoords.push_back(c.vt == kNone ? std::array<float, 2>{} : texcoords_[c.vt]);
    if (std::ranges::any_of(first_use_, [](const Corner& c) { return c.vn != kNone; }))
      for (const Corner& c : first_use_)
        mesh_.normals.push_back(c.vn == kNone ? std::array<float, 3>{} : normals_[c.vn]);
  }

  static constexpr std::uint32_t kSplit = 0x80000000u;

  Mesh mesh_;
  std::vector<std::array<float, 2>> texcoords_;
  std::vector<std::array<float, 3>> normals_;
  std::vector<Corner> first_use_, splits_;
  std::unordered_map<Corner, std::uint32_t, CornerHash> split_;
  std::vector<std::uint32_t> polygon_;
  std::string why_;
};

/// What a statement of a material library names, behind its options.
std::string_view picture_name(std::string_view line) {
  std::string_view name = text::trim(line);
  while (name.starts_with('-')) {  // options: -name followed by values that are numbers or words
    text::take_word(name);
    text::take_word(name);
    name = text::trim(name);
    double number;
    for (std::string_view rest = name; text::parse(text::take_word(rest), number);)
      name = text::trim(rest);
  }
  return name;
}

}  // namespace

Result<Mesh> decode_obj(std::string_view bytes) { return ObjReader().read(bytes); }

std::string diffuse_texture(std::string_view mtl_text, std::string_view material) {
  text::Lines lines(mtl_text, text::Lines::Join::at_backslash);
  bool wanted = material.empty();
  for (std::string_view line; lines.next(line);) {
    const std::string_view word = text::take_word(line);
    if (word == "newmtl") wanted = material.empty() || text::trim(line) == material;
    if (word == "map_Kd" && wanted) return std::string(picture_name(line));
  }
  return {};
}

std::vector<std::string> pictures_of_materials(std::string_view mtl_text) {
  constexpr std::string_view kOthers[] = {"bump", "disp", "decal", "refl", "norm"};
  std::vector<std::string> names;
  text::Lines lines(mtl_text, text::Lines::Join::at_backslash);
  for (std::string_view line; lines.next(line);) {
    const std::string_view word = text::take_word(line);
    if (!word.starts_with("map_") && std::ranges::find(kOthers, word) == std::end(kOthers))
      continue;
    if (const std::string_view name = picture_name(line); !name.empty()) names.emplace_back(name);
  }
  return names;
}

}  // namespace tind::proto
