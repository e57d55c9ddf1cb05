// Any bytes as a catalog's table: a reason, or a tree that is not too deep to be walked.

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "server/services/datasets/dataset_spec.h"
#include "server/services/datasets/toml_file.h"

namespace {

using tind::services::TomlValue;

int depth(const TomlValue& value) {
  int deepest = 0;
  if (value.list())
    for (const TomlValue& item : *value.list()) deepest = std::max(deepest, depth(item));
  if (value.table())
    for (const auto& [key, item] : *value.table()) deepest = std::max(deepest, depth(item));
  return deepest + 1;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto table = tind::services::parse_toml(text, "x.toml");
  if (!table) {
    if (!table.error().what.starts_with("x.toml:")) std::abort();
    return 0;
  }
  const TomlValue whole{.line = 1, .is_text = false, .value = *table};
  if (depth(whole) > 260) std::abort();
  (void)tind::services::read_dataset_table(whole, "x.toml", "x");
  return 0;
}
