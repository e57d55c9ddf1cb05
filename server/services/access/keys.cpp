#include "server/services/access/keys.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>

#include "terrain/base/random_bytes.h"

namespace tind::services {
namespace {

constexpr std::string_view kPrefix = "tind_";
constexpr http::Scope kScopes[] = {http::Scope::tiles, http::Scope::read, http::Scope::jobs,
                                   http::Scope::admin};

/// Reads digits off the front, so many as there are to be.
std::optional<int> take_number(std::string_view& text, std::size_t digits) {
  int value = 0;
  const char* const end = text.data() + std::min(digits, text.size());
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != text.data() + digits || text.front() == '-') return {};
  text.remove_prefix(digits);
  return value;
}

bool take(std::string_view& text, char c) {
  if (!text.starts_with(c)) return false;
  text.remove_prefix(1);
  return true;
}

/// RFC 4648, 5: without padding.
std::string base64url(const std::array<std::uint8_t, 32>& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::string text;
  std::uint32_t held = 0;
  int bits = 0;
  for (const std::uint8_t byte : bytes) {
    held = held << 8 | byte;
    for (bits += 8; bits >= 6; bits -= 6) text += kDigits[held >> (bits - 6) & 63];
  }
  if (bits > 0) text += kDigits[held << (6 - bits) & 63];
  return text;
}

}  // namespace

double Rate::most_at_once() const { return burst > 0 ? burst : std::max(1.0, 2 * per_second); }

std::optional<http::Scope> scope_named(std::string_view text) {
  for (const http::Scope scope : kScopes)
    if (name(scope) == text) return scope;
  return {};
}

Result<std::vector<http::Scope>> scopes_of(std::string_view text) {
  std::vector<http::Scope> scopes;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(','));
    text.remove_prefix(std::min(word.size() + 1, text.size()));
    const auto scope = scope_named(word);
    if (!scope)
      return fail(Errc::invalid_argument,
                  "'" + std::string(word) + "' is none of tiles, read, jobs, admin");
    if (std::ranges::find(scopes, *scope) == scopes.end()) scopes.push_back(*scope);
  }
  return scopes;
}

std::string scopes_text(const std::vector<http::Scope>& scopes) {
  std::string text;
  for (const http::Scope scope : scopes) text.append(text.empty() ? "" : ",").append(name(scope));
  return text;
}

std::optional<SystemTime> time_of(std::string_view text) {
  using namespace std::chrono;
  const auto y = take_number(text, 4);
  if (!y || !take(text, '-')) return {};
  const auto m = take_number(text, 2);
  if (!m || !take(text, '-')) return {};
  const auto d = take_number(text, 2);
  if (!d) return {};
  const year_month_day date{year(*y), month(unsigned(*m)), day(unsigned(*d))};
  if (!date.ok()) return {};
  const SystemTime begin = sys_days(date);
  if (text.empty()) return begin + days(1);
  if (!take(text, 'T')) return {};
  const auto hour = take_number(text, 2);
  if (!hour || *hour > 23 || !take(text, ':')) return {};
  const auto minute = take_number(text, 2);
  if (!minute || *minute > 59 || !take(text, ':')) return {};
  const auto second = take_number(text, 2);
  if (!second || *second > 59 || text != "Z") return {};
  return begin + hours(*hour) + minutes(*minute) + seconds(*second);
}

std::optional<Sha256> hash_of_hex(std::string_view text) {
  Sha256 hash;
  if (text.size() != 2 * hash.size()) return {};
  for (std::size_t i = 0; i < hash.size(); ++i) {
    const char* const digits = text.data() + 2 * i;
    const auto [end, error] = std::from_chars(digits, digits + 2, hash[i], 16);
    if (error != std::errc() || end != digits + 2) return {};
  }
  return hash;
}

Result<std::string> make_secret() {
  std::array<std::uint8_t, 32> bytes{};
  if (auto made = random_bytes(bytes); !made) return std::unexpected(made.error());
  return std::string(kPrefix) + base64url(bytes);
}

const Key* find_key(const std::vector<Key>& keys, std::string_view secret) {
  const Sha256 hash = sha256({secret.data(), secret.size()});
  const Key* found = nullptr;
  for (const Key& key : keys) {
    volatile std::uint8_t unlike = 0;
    for (std::size_t i = 0; i < hash.size(); ++i)
      unlike = std::uint8_t(unlike | (hash[i] ^ key.hash[i]));
    found = unlike == 0 ? &key : found;
  }
  return found;
}

}  // namespace tind::services
