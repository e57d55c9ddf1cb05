#pragma once
// VRTs that name VRTs: how much work one of them asks for is counted before GDAL reads it.

#include <string>

#include "terrain/base/result.h"

namespace tind::gdal {

/// Whether a file can be read in time that its rasters account for: through all VRTs below it they
/// are named at most kMostVrtTimes as often as there are of them (or kFewVrtSources times: bands),
/// at most kMostVrtDepth VRTs lie above one another, none lies above itself, and none names memory.
/// Nine VRTs of ten times the next are a billion reads of one small file. Files that are no VRT are
/// fine. Errc::unsupported names the VRT. Cost: each VRT is parsed once, the first bytes of each
/// named file are read.
inline constexpr long long kMostVrtTimes = 64;
inline constexpr long long kFewVrtSources = 4096;
inline constexpr int kMostVrtDepth = 32;
Result<void> check_vrt_nesting(const std::string& path);

}  // namespace tind::gdal
