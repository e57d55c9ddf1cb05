#include "server/services/datasets/key_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/services/datasets/dataset_settings.h"
#include "server/services/datasets/dataset_spec.h"

namespace tind::services {
namespace {

constexpr std::size_t kLongestName = 64;
constexpr double kMostRate = 1e6;

std::unexpected<Error> wrong(const std::string& where, const std::string& what) {
  return fail(Errc::invalid_argument, where + ": " + what);
}

/// A text, or a list of texts.
std::optional<std::vector<std::string>> texts_of(const TomlValue& value) {
  if (value.is_text) return std::vector{*value.scalar()};
  if (!value.list()) return std::nullopt;
  std::vector<std::string> texts;
  for (const TomlValue& item : *value.list()) {
    if (!item.is_text) return std::nullopt;
    texts.push_back(*item.scalar());
  }
  return texts;
}

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= kLongestName &&
         std::ranges::all_of(text, [](unsigned char c) { return c > 0x20 && c < 0x7f; });
}

Result<void> read_scopes(const TomlValue& value, const std::string& where, Key& key) {
  const auto texts = texts_of(value);
  if (!texts || texts->empty())
    return wrong(where, "scopes must be a list of tiles, read, jobs, admin");
  for (const std::string& text : *texts) {
    const auto scope = scope_named(text);
    if (!scope) return wrong(where, "scopes: '" + text + "' is none of tiles, read, jobs, admin");
    key.scopes.push_back(*scope);
  }
  return {};
}

Result<void> read_rate(const TomlValue& value, const std::string& where, double& rate,
                       const char* name, double least) {
  const auto number = value.scalar() && !value.is_text
                          ? parse_number(*value.scalar(), least, kMostRate)
                          : Result<double>(fail(Errc::invalid_argument, "must be a number"));
  if (!number) return wrong(where, fmt::format("{}: {}", name, number.error().what));
  rate = *number;
  return {};
}

Result<void> read_member(const std::string& name, const TomlValue& value, const std::string& where,
                         Key& key, bool& has_hash) {
  const std::string* const text = value.is_text ? value.scalar() : nullptr;
  if (name == "name") {
    if (!text || !is_name(*text))
      return wrong(where, "name must be 1 to 64 letters, digits or signs, without blanks");
    key.name = *text;
  } else if (name == "sha256") {
    const auto hash = text ? hash_of_hex(*text) : std::nullopt;
    if (!hash) return wrong(where, "sha256 must be the 64 digits that tind key new prints");
    key.hash = *hash;
    has_hash = true;
  } else if (name == "scopes") {
    return read_scopes(value, where, key);
  } else if (name == "datasets") {
    auto texts = texts_of(value);
    if (!texts || texts->empty())
      return wrong(where, "datasets must be a list of names; leave it out for all");
    key.datasets = std::move(*texts);
  } else if (name == "rate") {
    return read_rate(value, where, key.rate.per_second, "rate", 1e-3);
  } else if (name == "burst") {
    return read_rate(value, where, key.rate.burst, "burst", 1);
  } else if (name == "expires") {
    key.expires = text ? time_of(*text) : std::nullopt;
    if (!key.expires)
      return wrong(where, "expires must be \"2027-01-31\" or \"2027-01-31T12:00:00Z\"");
  } else {
    return wrong(where, "unknown key " + name + " of a [[key]]" +
                            did_you_mean(name, {"name", "sha256", "scopes", "datasets", "rate",
                                                "burst", "expires"}));
  }
  return {};
}

}  // namespace

Result<Key> read_key_table(const TomlValue& value, const std::string& file) {
  const std::string begin = fmt::format("{}:{}", file, value.line);
  if (!value.table()) return wrong(begin, "write a key as a table, [[key]]");
  Key key;
  key.where = begin;
  bool has_hash = false;
  for (const auto& [name, member] : *value.table()) {
    const std::string where = fmt::format("{}:{}", file, member.line);
    if (auto read = read_member(name, member, where, key, has_hash); !read)
      return std::unexpected(read.error());
  }
  if (key.name.empty()) return wrong(begin, "a [[key]] without name");
  if (!has_hash) return wrong(begin, "a [[key]] without sha256; tind key new prints one");
  if (key.scopes.empty()) return wrong(begin, "a [[key]] without scopes");
  if (key.rate.burst > 0 && key.rate.per_second == 0)
    return wrong(begin, "burst says how many requests of the rate may come at once: give rate");
  return key;
}

std::string print_key_table(const Key& key) {
  std::string out = fmt::format("\n[[key]]\nname = {}\nsha256 = \"{}\"\nscopes = [",
                                toml_quoted(key.name), hex_of(key.hash));
  for (std::size_t i = 0; i < key.scopes.size(); ++i)
    out += fmt::format("{}\"{}\"", i > 0 ? ", " : "", name(key.scopes[i]));
  out += "]\n";
  if (!key.datasets.empty()) {
    out += "datasets = [";
    for (std::size_t i = 0; i < key.datasets.size(); ++i)
      out += (i > 0 ? ", " : "") + toml_quoted(key.datasets[i]);
    out += "]\n";
  }
  if (key.rate.per_second > 0) out += fmt::format("rate = {}\n", key.rate.per_second);
  if (key.rate.burst > 0) out += fmt::format("burst = {}\n", key.rate.burst);
  if (key.expires) {
    using namespace std::chrono;
    const auto date = floor<days>(*key.expires);
    const year_month_day day(date);
    const hh_mm_ss time(*key.expires - date);
    out += fmt::format("expires = \"{:04}-{:02}-{:02}T{:02}:{:02}:{:02}Z\"\n", int(day.year()),
                       unsigned(day.month()), unsigned(day.day()), time.hours().count(),
                       time.minutes().count(), time.seconds().count());
  }
  return out;
}

Result<std::vector<std::string>> origins_of(std::string_view text) {
  std::vector<std::string> origins;
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find(','));
    text.remove_prefix(std::min(one.size() + 1, text.size()));
    const auto scheme = one.find("://");
    const bool good =
        one == "*" ||
        (scheme != one.npos && scheme > 0 && one.size() > scheme + 3 &&
         one.find('/', scheme + 3) == one.npos &&
         std::ranges::all_of(one, [](unsigned char c) { return c > 0x20 && c < 0x7f; }));
    if (!good)
      return fail(Errc::invalid_argument,
                  "'" + std::string(one) + "' is no origin, https://example.org without a path");
    origins.emplace_back(one);
  }
  return origins;
}

}  // namespace tind::services
