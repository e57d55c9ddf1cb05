#include "terrain/raster/nodata.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <set>

namespace tind {

namespace {

bool is_none(std::string_view word) {
  return std::ranges::equal(word, std::string_view("none"),
                            [](unsigned char a, unsigned char b) { return std::tolower(a) == b; });
}

}  // namespace

Result<void> set_nodata(std::string_view text, DemOptions& options) {
  const std::string whole(text);
  options.nodata.clear();
  options.ignore_declared_nodata = false;
  for (;;) {
    const std::string_view word = text.substr(0, text.find(','));
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (is_none(word))
      options.ignore_declared_nodata = true;
    else if (error == std::errc() && end == word.data() + word.size() && std::isfinite(value))
      options.nodata.push_back(value);
    else
      return fail(Errc::invalid_argument,
                  "'" + whole + "' is neither a number, nor several with commas between, nor none");
    if (word.size() == text.size()) return {};
    text.remove_prefix(word.size() + 1);
  }
}

std::string nodata_text(const DemOptions& options) {
  std::string text = options.ignore_declared_nodata ? "none" : "";
  for (const double value : options.nodata)
    text += fmt::format("{}{}", text.empty() ? "" : ",", value);
  return text;
}

std::string undeclared_nodata_text(const DemSource& dem) {
  const auto found = dem.undeclared_nodata();
  if (found.empty()) return {};
  std::string counts, values = dem.info().nodata_said;
  std::set<std::size_t> having;
  for (const UndeclaredNodata& one : found) {
    having.insert(one.files.begin(), one.files.end());
    counts += fmt::format("{}{} {} {}", counts.empty() ? "" : ", ", one.posts,
                          one.posts == 1 ? "post is" : "posts are", one.value);
    values += fmt::format("{}{}", values.empty() ? "" : ",", one.value);
  }
  return fmt::format(
      "{}{}: {}, taken for heights, since the file does not say that this means no data; if it "
      "does: --nodata {}",
      dem.info().files[having.empty() ? 0 : *having.begin()],
      having.size() > 1 ? fmt::format(" and {} more", having.size() - 1) : "", counts, values);
}

}  // namespace tind
