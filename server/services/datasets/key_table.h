#pragma once
// [[key]] tables of a configuration file.

#include <string>
#include <string_view>
#include <vector>

#include "server/services/access/keys.h"
#include "server/services/datasets/toml_file.h"
#include "terrain/base/result.h"

namespace tind::services {

/// name, sha256 and scopes are required; datasets, rate, burst and expires are not. The error names
/// the file, the line and what to write.
Result<Key> read_key_table(const TomlValue&, const std::string& file);

/// As a table that read_key_table reads.
std::string print_key_table(const Key&);

/// "https://a.example,http://localhost:5173", or "*": the error says what is none.
Result<std::vector<std::string>> origins_of(std::string_view text);

}  // namespace tind::services
