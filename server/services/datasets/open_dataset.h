#pragma once
// From what the operator names to a dataset that can be served.

#include <string>

#include "server/services/datasets/catalog.h"
#include "server/services/datasets/dataset_settings.h"
#include "server/services/datasets/dataset_spec.h"
#include "terrain/base/result.h"
#include "terrain/dataset/dataset.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/raster/dem_source.h"
#include "terrain/surface/surface.h"

namespace tind::services {

/// The spec's DEM, or the layers that its files make; one file of no such name that holds commas
/// gets a hint at "NAME=a,b" and at [[dataset]].
Result<Surface> open_source(const DatasetSpec&, const DemOptions&);

/// Opens the spec's files; the error says which cannot be opened, and why. Residual indexes of
/// large DEMs are kept in `index_dir`; nowhere where that is empty.
Result<Dataset> open_dataset(const DatasetSpec&, const DatasetOptions&,
                             const std::string& index_dir = {});

/// The same, added to the catalog under its name.
Result<void> open_dataset(Catalog&, const DatasetSpec&, const DemOptions&, const TileSetOptions&,
                          const std::string& index_dir = {});

}  // namespace tind::services
