#pragma once
// Keys: who may ask what of the daemon, and how often. The daemon knows hashes of keys only. A key
// is 256 random bits, so that a plain SHA-256 of it tells nobody anything.

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/operation.h"
#include "terrain/base/result.h"
#include "terrain/base/sha256.h"

namespace tind::services {

/// So many requests a second, and so many at once after a rest. 0: no limit.
struct Rate {
  double per_second = 0;
  double burst = 0;  // 0: twice those of a second, one at least
  double most_at_once() const;
  bool operator==(const Rate&) const = default;
};

using SystemTime = std::chrono::sys_seconds;

/// A [[key]] table of the configuration.
struct Key {
  std::string name;  // for logs and jobs
  Sha256 hash{};
  std::vector<http::Scope> scopes;    // at least one
  std::vector<std::string> datasets;  // empty: all
  Rate rate;
  std::optional<SystemTime> expires;  // from then on it is none
  std::string where = {};             // the table's file and line
};

struct AccessRules {
  std::vector<Key> keys;                   // empty: everybody may ask everything
  std::vector<http::Scope> without_a_key;  // what needs none all the same
  Rate per_address;                        // of who shows no key
};

/// tiles, read, jobs, admin.
std::optional<http::Scope> scope_named(std::string_view);
/// "tiles,read"; the error names the word that is none.
Result<std::vector<http::Scope>> scopes_of(std::string_view text);
std::string scopes_text(const std::vector<http::Scope>&);

/// "2027-01-31", to the end of that day, UTC, or "2027-01-31T12:00:00Z".
std::optional<SystemTime> time_of(std::string_view text);

/// 64 digits.
std::optional<Sha256> hash_of_hex(std::string_view text);

/// "tind_" and 43 characters: 256 bits of the system's randomness.
Result<std::string> make_secret();

/// The key with that secret; null: none. Takes as long whichever it is.
const Key* find_key(const std::vector<Key>&, std::string_view secret);

}  // namespace tind::services
