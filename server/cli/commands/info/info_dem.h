#pragma once
// The part of `tind info` that is about DEMs.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "server/cli/options/dem_input.h"
#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"

namespace tind::cli {

struct InfoDemOptions {
  bool stats = false;  // read every post, however many there are
  bool json = false;
  bool quiet = false;  // no warnings: of many inputs they would hide the lines
  std::string progress = "auto";
};

/// Prints what a DEM is, unless --json was asked for: then that is the result. Reads all posts of
/// one of up to kStreamPosts (dem_strips.h) and, asked for, of a larger one: a damaged file is
/// found out then. Else a sample of them.
/// `read`: the options that the DEM was opened with.
Result<nlohmann::ordered_json> info_dem(const DemSource&, const DemOptions& read,
                                        const InfoDemOptions&);

/// A share in per cent of so many digits, or of as many more as tell a few heights from none:
/// "100" is all.
std::string percent_text(double share, int digits);

}  // namespace tind::cli
