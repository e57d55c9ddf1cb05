#pragma once
// The daemon's life: it opens its datasets, wires the rooms together from the bottom up, and runs
// until it is told to stop.

#include "server/cli/daemon/daemon_options.h"
#include "server/services/datasets/config.h"

namespace tind::cli {

/// Returns the exit code. Signals are as ignore_signals() leaves them.
int run_daemon(const services::Config&, const DaemonOptions&);

}  // namespace tind::cli
