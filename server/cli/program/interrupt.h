#pragma once
// Ctrl-C and SIGTERM for commands that write many files: what is at hand is finished.

#include "server/cli/program/progress_bar.h"

namespace tind::cli {

/// From now on a first signal stops what runs under stoppable() at its next report; a second one
/// ends the program at once.
void finish_on_signals();

/// The bar's progress, which such a signal stops.
Progress stoppable(ProgressBar&);

}  // namespace tind::cli
