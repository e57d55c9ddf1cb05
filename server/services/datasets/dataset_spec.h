#pragma once
// What the operator names to be served as one dataset: on a command line, or as a [[dataset]] table
// of a configuration file.

#include <string>
#include <string_view>
#include <vector>

#include "server/services/datasets/dataset_settings.h"
#include "server/services/datasets/toml_file.h"
#include "terrain/base/result.h"
#include "terrain/surface/open_surface.h"

namespace tind::services {

/// A [[dataset.layer]] table, or a --layer.
struct LayerTable {
  std::string name;
  std::vector<std::string> files;  // of one grid; of a table: may be patterns
  SettingTexts own = {};           // options of a DEM, other than the dataset's; blend, error
};

/// One raster, several as one source, or a directory made by `tind build`; or layers.
struct DatasetSpec {
  std::string name;                     // empty: from the first file's name
  std::vector<std::string> files;       // of a table: may be patterns (*, ?, [a-c])
  SettingTexts own = {};                // what its table says
  std::string where = {};               // the table's file and line; empty: it has none
  std::vector<LayerTable> layers = {};  // the lowest first; then `files` are theirs, one after the
                                        // other. Empty: the files make their layers themselves
};

/// "alps=a.tif,b.tif" or just a path. (Files whose names hold commas are named in a table.)
DatasetSpec parse_dataset_spec(const std::string& text);

/// A table of `file`, whose paths are relative to the file's folder. `name`: where it has none; if
/// that is empty, it may be without.
Result<DatasetSpec> read_dataset_table(const TomlValue&, const std::string& file,
                                       const std::string& name = {});

/// As a [[dataset]] table that read_dataset_table reads.
std::string print_dataset_table(const DatasetSpec&);

/// The spec's files with its patterns replaced by the files that fit them, in the order of their
/// names; each once. An error names a pattern that fits nothing.
Result<std::vector<std::string>> files_of(const DatasetSpec&);

/// "N52E008" of "/dems/N52E008.hgt.zip".
std::string name_of_file(const std::string& path);

/// What its layers are opened with, patterns replaced; `dem`: what is said of all. REQUIRES:
/// layers.
struct LayerSpecs {
  std::vector<LayerSpec> layers;
  SurfaceOptions options;
};
Result<LayerSpecs> layers_of(const DatasetSpec&, const DemOptions& dem);

/// The name that the spec gives, or that of its first file without the extension.
std::string name_of(const DatasetSpec&);

/// A directory of tiles, and no DEM?
bool is_stored(const DatasetSpec&);

/// [A-Za-z0-9._-]{1,64}, not beginning with a dot. Letters of Latin scripts lose their accents,
/// what else is none of these becomes '_', and where nothing is left the name is "dataset".
std::string safe_name(std::string_view text);

/// One line of a value that is wrong, which it names once.
std::string wrong_value(const std::string& name, const std::string& value, const std::string& what);

/// "; did you mean max_error?", of the name that is nearest to `unknown`; empty where none is near.
std::string did_you_mean(std::string_view unknown, const std::vector<std::string>& names);

/// A setting's name in a file: max_error.
std::string file_key(std::string name);

}  // namespace tind::services
