#pragma once
// What `tind serve` is told on its command line, and the configuration that comes of it.

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/cli/options/surface_input.h"
#include "server/services/datasets/config.h"
#include "terrain/base/result.h"
#include "terrain/geo/environment.h"

namespace tind::cli {

struct DaemonOptions {
  std::string config_file;
  std::map<std::string, std::string> flags;  // of services::settings(), by name
  std::vector<std::string> datasets;
  SurfaceInput layers;  // one more dataset
  std::shared_ptr<const Environment> environment;
};

/// Flags, the process's environment and the file, as they are now: a reload asks again.
Result<services::Config> configure(const DaemonOptions&);

}  // namespace tind::cli
