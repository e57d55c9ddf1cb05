#pragma once
// From what the operator names on the command line to a dataset that can be served.

#include <string>
#include <vector>

#include "server/services/datasets/catalog.h"
#include "terrain/base/result.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/raster/dem_source.h"

namespace tind::services {

/// What the operator named: one raster, several as one source, or a directory made by `tind build`.
struct DatasetSpec {
  std::string name;  // empty: from the first file's name
  std::vector<std::string> files;
};

/// "alps=a.tif,b.tif" or just a path.
DatasetSpec parse_dataset_spec(const std::string& text);

/// A directory of tiles, and no DEM?
bool is_stored(const DatasetSpec&);

/// The spec's DEM; one file of no such name that holds commas gets a hint at "NAME=a,b".
Result<std::shared_ptr<const DemSource>> open_dem(const DatasetSpec&, const DemOptions&);

/// Opens the spec's files and adds them; the error says which cannot be opened, and why. Residual
/// indexes of large DEMs are kept in `index_dir`; nowhere where that is empty.
Result<void> open_dataset(Catalog&, const DatasetSpec&, const DemOptions&, const TileSetOptions&,
                          const std::string& index_dir = {});

}  // namespace tind::services
