// STL, binary and ascii: triangles without topology. Corners at equal positions become one vertex,
// numbered in the order of the file.

#include <algorithm>
#include <bit>
#include <string>

#include "proto/mesh/mesh_io.h"
#include "proto/text_scan.h"
#include "terrain/base/bytes.h"
#include "terrain/base/keyed_hash.h"
#include "terrain/base/lower_case.h"

namespace tind::proto {
namespace {

using Position = std::array<double, 3>;

/// Position -> number, by open addressing (half of the slots stay free).
class Welder {
 public:
  explicit Welder(std::vector<Position>& positions) : positions_(positions), slots_(64, kFree) {}

  std::uint32_t number(const Position& p) {
    if (2 * positions_.size() >= slots_.size()) grow();
    std::uint32_t& slot = find(p);
    if (slot == kFree) {
      slot = std::uint32_t(positions_.size());
      positions_.push_back(p);
    }
    return slot;
  }

 private:
  static constexpr std::uint32_t kFree = ~std::uint32_t(0);

  static std::uint64_t hash(const Position& p) {
    std::uint64_t h = 0;
    for (const double x : p)
      h = keyed_hash(h ^ std::bit_cast<std::uint64_t>(x + 0.0));  // -0 and 0 are one place
    return h;
  }
  std::uint32_t& find(const Position& p) {
    std::size_t i = hash(p) & (slots_.size() - 1);
    while (slots_[i] != kFree && positions_[slots_[i]] != p) i = (i + 1) & (slots_.size() - 1);
    return slots_[i];
  }
  void grow() {
    slots_.assign(2 * slots_.size(), kFree);
    for (std::uint32_t i = 0; i < positions_.size(); ++i) find(positions_[i]) = i;
  }

  std::vector<Position>& positions_;
  std::vector<std::uint32_t> slots_;
};

void add_triangle(Mesh& mesh, Welder& welder, const Position& a, const Position& b,
                  const Position& c) {
  const std::array<std::uint32_t, 3> t = {welder.number(a), welder.number(b), welder.number(c)};
  if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
}

/// What encode_stl put there, else zero.
Position header_origin(std::string_view header) {
  Position origin{};
  if (!header.starts_with("tind origin ")) return {};
  header.remove_prefix(12);
  for (double& x : origin)
    if (!text::parse_finite(text::take_word(header), x)) return {};
  return origin;
}

Result<Mesh> decode_binary(std::string_view bytes) {
  if (bytes.size() < 84) return fail(Errc::bad_data, "STL: shorter than its header");
  const std::size_t count = load<std::uint32_t>(bytes.data() + 80);
  if (count > (bytes.size() - 84) / 50)
    return fail(Errc::bad_data, "STL byte 80: " + std::to_string(count) + " triangles, but only " +
                                    std::to_string((bytes.size() - 84) / 50) + " are there");
  const Position origin = header_origin(bytes.substr(0, 80));
  Mesh mesh;
  Welder welder(mesh.positions);
  for (std::size_t t = 0; t < count; ++t) {
    const char* at = bytes.data() + 84 + 50 * t + 12;  // the normal is implied by the corners
    Position corners[3];
    for (Position& corner : corners)
      for (int i = 0; i < 3; ++i, at += 4) {
        corner[i] = double(load<float>(at)) + origin[i];
        if (!std::isfinite(corner[i]))
          return fail(Errc::bad_data, "STL byte " + std::to_string(at - bytes.data()) +
                                          ": a coordinate is not finite");
      }
    add_triangle(mesh, welder, corners[0], corners[1], corners[2]);
  }
  return mesh;
}

Result<Mesh> decode_ascii(std::string_view bytes) {
  Mesh mesh;
  Welder welder(mesh.positions);
  std::vector<Position> loop;
  bool ended = false;
  text::Lines lines(bytes);
  for (std::string_view line; lines.next(line);) {
    const std::string word = lower_case(text::take_word(line));
    const auto reject = [&](const char* why) {
      return fail(Errc::bad_data, "STL line " + std::to_string(lines.number()) + ": " + why);
    };
    if (word == "solid") ended = false;  // there may be several
    if (word == "endsolid") ended = true;
    if (word == "outer") loop.clear();
    if (word == "vertex") {
      Position p;
      for (double& x : p)
        if (!text::parse_finite(text::take_word(line), x))
          return reject("vertex needs three finite numbers");
      loop.push_back(p);
    }
    if (word == "endloop") {
      if (loop.size() < 3) return reject("a loop needs three vertices");
      for (std::size_t i = 2; i < loop.size(); ++i)
        add_triangle(mesh, welder, loop[0], loop[i - 1], loop[i]);
      loop.clear();  // it is one loop, however often its end is said
    }
  }
  if (!ended) return fail(Errc::bad_data, "STL: cut off, there is no endsolid");
  return mesh;
}

/// Binary files may begin with "solid" too; their size gives them away.
bool is_ascii(std::string_view bytes) {
  std::string_view text = bytes;
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // a byte order mark
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  if (lower_case(text.substr(0, 5)) != "solid") return false;
  return bytes.size() < 84 ||
         bytes.size() != 84 + 50 * std::size_t(load<std::uint32_t>(bytes.data() + 80));
}

}  // namespace

Result<Mesh> decode_stl(std::string_view bytes) {
  return is_ascii(bytes) ? decode_ascii(bytes) : decode_binary(bytes);
}

}  // namespace tind::proto
