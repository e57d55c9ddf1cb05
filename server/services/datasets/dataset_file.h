#pragma once
// A file that holds the keys of one [[dataset]] table, as it lies in a catalog's folder.

#include <string>

#include "server/services/datasets/dataset_spec.h"
#include "terrain/base/result.h"
#include "terrain/pyramid/plan/tile_set_options.h"

namespace tind::services {

/// `name`: where the file gives none.
Result<DatasetSpec> read_dataset_file(const std::string& file, const std::string& name);

/// As read_dataset_file() reads it. REQUIRES: no layers.
std::string print_dataset_file(const DatasetSpec&);

/// How tiles are made, as settings of a dataset say it.
SettingTexts setting_texts(const TileSetOptions&);

}  // namespace tind::services
