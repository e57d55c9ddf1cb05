// 2DM, the mesh cards of Aquaveo's SMS: a node or an element a line, numbered from 1. Readers want
// MESH2D in the first line, and nodes in the order of their numbers.

#include <algorithm>
#include <unordered_map>

#include "proto/mesh/mesh_io.h"
#include "proto/mesh/mesh_quad.h"
#include "proto/text_put.h"
#include "proto/text_scan.h"
#include "terrain/base/keyed_hash.h"

namespace tind::proto {
namespace {

void put_card(std::string& out, const char* card, std::size_t id) {
  out += card;
  out += ' ';
  text::put_text(out, id);
}

/// Cards are in capitals, but not of every program.
std::string in_capitals(std::string_view word) {
  std::string out(word.substr(0, 8));
  for (char& c : out)
    if (c >= 'a' && c <= 'z') c = char(c - 'a' + 'A');
  return out;
}

class Reader2dm {
 public:
  Result<Mesh> read(std::string_view bytes) {
    text::Lines lines(bytes);
    std::string_view line;
    if (!lines.next(line) || in_capitals(text::take_word(line)) != "MESH2D")
      return fail(Errc::bad_data, "not a 2DM file: it does not begin with MESH2D");
    while (lines.next(line)) {
      const std::string why = card(line);
      if (!why.empty())
        return fail(Errc::bad_data, "2DM line " + std::to_string(lines.number()) + ": " + why);
    }
    return resolve();
  }

 private:
  /// Empty, or what is wrong.
  std::string card(std::string_view rest) {
    if (rest.starts_with('#')) read_place_line(rest.substr(1), mesh_.place);
    const std::string word = in_capitals(text::take_word(rest));
    if (word == "ND") return node(rest);
    if (word == "E3T") return element(rest, 3);
    if (word == "E4Q") return element(rest, 4);
    for (const char* other : {"E6T", "E8Q", "E9Q"})
      if (word == other) return word + " elements have curved sides; only E3T and E4Q are read";
    return {};
  }

  std::string node(std::string_view rest) {
    std::uint64_t id = 0;
    std::array<double, 3> p{};
    if (!text::parse(text::take_word(rest), id)) return "ND needs a number";
    for (double& x : p)
      if (!text::parse_finite(text::take_word(rest), x)) return "ND needs three finite coordinates";
    if (!number_.try_emplace(id, std::uint32_t(mesh_.positions.size())).second)
      return "there is a node " + std::to_string(id) + " already";
    mesh_.positions.push_back(p);
    return {};
  }

  std::string element(std::string_view rest, std::size_t corners) {
    std::array<std::uint64_t, 4> ids{};
    text::take_word(rest);  // its own number
    for (std::size_t i = 0; i < corners; ++i)
      if (!text::parse(text::take_word(rest), ids[i])) return "an element needs its nodes";
    if (corners == 3) ids[3] = ids[2];
    named_.push_back(ids);
    return {};
  }

  /// Elements may come before their nodes.
  Result<Mesh> resolve() {
    for (const auto& ids : named_) {
      std::array<std::uint32_t, 4> q{};
      for (std::size_t i = 0; i < 4; ++i) {
        const auto at = number_.find(ids[i]);
        if (at == number_.end())
          return fail(Errc::bad_data, "2DM: an element names node " + std::to_string(ids[i]) +
                                          ", which is not there");
        q[i] = at->second;
      }
      if (ids[2] == ids[3])
        mesh_.triangles.push_back({q[0], q[1], q[2]});
      else
        for (const auto& t : split_quad(mesh_.positions, q)) mesh_.triangles.push_back(t);
    }
    return std::move(mesh_);
  }

  Mesh mesh_;
  std::unordered_map<std::uint64_t, std::uint32_t, KeyedHash> number_;
  std::vector<std::array<std::uint64_t, 4>> named_;  // a triangle has its last corner twice
};

}  // namespace

std::string encode_2dm(const Mesh& m) {
  std::string out = "MESH2D\nMESHNAME \"tind\"\n";
  out.reserve(out.size() + m.positions.size() * 64 + m.triangles.size() * 40);
  for (const std::string& line : place_lines(m.place)) out += "# " + line + "\n";
  for (std::size_t i = 0; i < m.positions.size(); ++i) {
    put_card(out, "ND", i + 1);
    for (const double x : m.positions[i]) text::put_text(out += ' ', x);
    out += '\n';
  }
  for (std::size_t t = 0; t < m.triangles.size(); ++t) {
    put_card(out, "E3T", t + 1);
    for (const std::uint32_t v : m.triangles[t]) text::put_text(out += ' ', v + 1);
    out += " 1\n";  // its material
  }
  return out;
}

Result<Mesh> decode_2dm(std::string_view bytes) { return Reader2dm().read(bytes); }

}  // namespace tind::proto
