#pragma once
// What a daemon is put together of, as its configuration says: for its start and for whoever looks
// beforehand whether it would start.

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "server/services/access/keys.h"
#include "server/services/datasets/catalog.h"
#include "server/services/datasets/catalog_keeper.h"
#include "server/services/datasets/config.h"
#include "server/services/datasets/dataset_settings.h"
#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind::cli {

/// For which a start waits for files that somebody is writing into the catalog's folder.
inline constexpr std::chrono::milliseconds kMostRest{5000};

/// For DEMs that the daemon reads and for those that processes of their own do.
std::shared_ptr<SourcePool> source_pool(const services::Config&);

/// What the operator should know of a dataset that was just opened, a line each.
std::vector<std::string> warnings_of(const services::ServedDataset&,
                                     const services::DatasetOptions&);

bool listens_here_alone(const std::string& listen);
/// Whoever reaches an address of more than this machine may ask what has no key; empty: nobody else
/// does. `listen`: where the daemon does, whatever a configuration that was read since says.
std::string warning_of_strangers(const std::string& listen, const services::AccessRules&);

/// The first load. Who starts a daemon, or checks its configuration, sees every reason why it does
/// not start: where there are several, they are printed, and the error says how many.
Result<services::CatalogChange> load_all(services::CatalogKeeper&);

/// Whether that folder, or the one in which it would be made, may be written to; the error names
/// the setting: io where another user might, invalid_argument where nobody can.
Result<void> check_writable(const char* setting, const std::string& folder);

}  // namespace tind::cli
