#include "server/services/datasets/dataset_file.h"

#include <fmt/format.h>

#include "server/services/datasets/toml_file.h"
#include "terrain/base/enum_names.h"
#include "terrain/simplify/method_text.h"

namespace tind::services {

Result<DatasetSpec> read_dataset_file(const std::string& file, const std::string& name) {
  const auto table = read_toml(file);
  if (!table) return std::unexpected(table.error());
  return read_dataset_table({.line = 1, .is_text = false, .value = *table}, file, name);
}

std::string print_dataset_file(const DatasetSpec& spec) {
  constexpr std::string_view kHead = "[[dataset]]\n";
  const std::string table = print_dataset_table(spec);
  return table.substr(table.find(kHead) + kHead.size());
}

SettingTexts setting_texts(const TileSetOptions& options) {
  SettingTexts texts = {{"max-error", fmt::format("{}", options.max_error_m)},
                        {"error-factor", fmt::format("{}", options.error_factor)},
                        {"side", name_of(options.side)},
                        {"effort", name_of(options.effort)},
                        {"method", method_text(options.method)}};
  if (options.last_level >= 0)
    texts["levels"] = fmt::format("{}-{}", options.first_level, options.last_level);
  return texts;
}

}  // namespace tind::services
