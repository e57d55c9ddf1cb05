// Recursive descent without recursion: three depths of brackets at most, each a function.

#include "proto/wkt.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

namespace tind::proto {
namespace {

constexpr std::pair<WktType, std::string_view> kNames[] = {
    {WktType::point, "POINT"},
    {WktType::multi_point, "MULTIPOINT"},
    {WktType::line_string, "LINESTRING"},
    {WktType::multi_line_string, "MULTILINESTRING"},
    {WktType::polygon, "POLYGON"},
    {WktType::multi_polygon, "MULTIPOLYGON"}};

class Reader {
 public:
  Reader(std::string_view text, std::size_t most) : all_(text), text_(text), most_(most) {}

  Result<WktGeometry> read() {
    WktGeometry g;
    if (!read_head(g))
      return wrong("must begin with POINT, LINESTRING, POLYGON or MULTI... of one");
    numbers_ = 2 + int(g.has_z) + int(g.has_m);
    const bool ok = read_body(g);
    if (why_.empty() && ok && (skip_blanks(), !text_.empty())) why_ = "ends before its text does";
    if (!why_.empty() || !ok) return wrong(why_.empty() ? "is no WKT" : why_);
    return g;
  }

 private:
  std::string_view all_, text_;
  const std::size_t most_;
  std::size_t count_ = 0;
  int numbers_ = 2;
  std::string why_;

  std::unexpected<Error> wrong(const std::string& why) const {
    return fail(Errc::invalid_argument,
                why + " (at character " + std::to_string(all_.size() - text_.size() + 1) + ")");
  }

  void skip_blanks() {
    const std::size_t end = text_.find_first_not_of(" +\t\r\n");
    text_.remove_prefix(std::min(end, text_.size()));
  }

  bool take(char c) {
    skip_blanks();
    if (!text_.starts_with(c)) return false;
    text_.remove_prefix(1);
    return true;
  }

  std::string take_word() {
    skip_blanks();
    std::string word;
    for (; !text_.empty() && ((text_[0] | 32) >= 'a' && (text_[0] | 32) <= 'z');
         text_.remove_prefix(1))
      word += char(text_[0] & ~32);
    return word;
  }

  /// "POINT", "POINT Z", "POINTZM".
  bool read_head(WktGeometry& g) {
    std::string word = take_word();
    const auto named = [&](std::string_view text) {
      const auto found =
          std::ranges::find(kNames, text, &std::pair<WktType, std::string_view>::second);
      if (found == std::end(kNames)) return false;
      g.type = found->first;
      return true;
    };
    const auto dimensions = [&](std::string_view text) {
      g.has_z = text.starts_with('Z'), g.has_m = text.ends_with('M');
      return text == "Z" || text == "M" || text == "ZM";
    };
    if (named(word)) {
      const std::string more = take_word();
      return more.empty() || dimensions(more);
    }
    const std::size_t end = word.find_last_not_of("ZM") + 1;
    return named(word.substr(0, end)) && dimensions(std::string_view(word).substr(end));
  }

  bool read_number(double& value) {
    skip_blanks();
    const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), value);
    if (error != std::errc() || !std::isfinite(value)) return false;
    text_.remove_prefix(std::size_t(end - text_.data()));
    return true;
  }

  bool read_place(WktLine& line) {
    std::array<double, 2> place{};
    double dropped = 0;
    for (int k = 0; k < numbers_; ++k)
      if (!read_number(k < 2 ? place[std::size_t(k)] : dropped)) {
        why_ = "must have " + std::to_string(numbers_) + " numbers a place";
        return false;
      }
    if (++count_ > most_) why_ = "must have at most " + std::to_string(most_) + " places";
    line.push_back(place);
    return why_.empty();
  }

  /// "(...)" of things with commas between.
  template <class Each>
  bool read_list(const Each& each) {
    if (!take('(')) return false;
    do {
      if (!each()) return false;
    } while (take(','));
    return take(')');
  }

  bool read_line(WktLine& line) {
    return read_list([&] { return read_place(line); });
  }
  bool read_points(WktLine& line) {
    return read_list([&] {
      if (!take('(')) return read_place(line);
      return read_place(line) && take(')');
    });
  }
  bool read_lines(std::vector<WktLine>& lines, std::size_t least, bool closed) {
    return read_list([&] { return read_whole_line(lines.emplace_back(), least, closed); });
  }
  bool read_whole_line(WktLine& line, std::size_t least, bool closed) {
    if (!read_line(line)) return false;
    if (line.size() < least)
      why_ = "must have at least " + std::to_string(least) + " places a line";
    if (why_.empty() && closed && line.front() != line.back())
      why_ = "has a ring that is not closed";
    return why_.empty();
  }

  bool read_body(WktGeometry& g) {
    constexpr std::size_t kLine = 2, kRing = 4;
    auto& first = g.parts.emplace_back();
    switch (g.type) {
      case WktType::point:
        return read_line(first.emplace_back()) && first[0].size() == 1;
      case WktType::multi_point:
        return read_points(first.emplace_back());
      case WktType::line_string:
        return read_whole_line(first.emplace_back(), kLine, false);
      case WktType::multi_line_string:
        return read_lines(first, kLine, false);
      case WktType::polygon:
        return read_lines(first, kRing, true);
      case WktType::multi_polygon:
        g.parts.clear();
        return read_list([&] { return read_lines(g.parts.emplace_back(), kRing, true); });
    }
    return false;
  }
};

}  // namespace

std::string_view name(WktType type) {
  return std::ranges::find(kNames, type, &std::pair<WktType, std::string_view>::first)->second;
}

Result<WktGeometry> decode_wkt(std::string_view text, std::size_t most) {
  return Reader(text, most).read();
}

}  // namespace tind::proto
