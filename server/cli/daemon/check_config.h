#pragma once
// tind serve --check-config: would the daemon start, and what would it leave alone? It puts the
// catalog together as a start does, by the same hands, but serves and writes nothing.

#include <functional>

#include "server/cli/daemon/daemon_options.h"
#include "server/services/datasets/config.h"
#include "terrain/base/result.h"

namespace tind::cli {

/// Fails with what would end the start; several reasons are printed. What a start would leave alone
/// of a catalog's folder is printed, and then an error, too. What it would only warn of is printed.
/// `say`: says it, and returns the exit code, as this does. What takes long to open holds up nobody
/// after that: the process ends within a second, whatever else it has to do.
int check_config(const services::Config&, const DaemonOptions&,
                 const std::function<int(const Result<void>&)>& say);

}  // namespace tind::cli
