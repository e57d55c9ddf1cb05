#pragma once
// Files by http(s), for looking at other people's tile sets. Sources are never read this way:
// remote files stay off for every raster (gdal_setup.cpp); only who calls this names a URL.

#include <cstdint>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind {

inline constexpr std::size_t kLargestFetch = 64u << 20;

/// The body behind a URL, unpacked where the server compressed it for the way. not_found for 404
/// and 410, io for whatever else is not 200. `accept` is sent as it is. Connections are kept and
/// used again; thread-safe. Blocks for 30 s at most.
Result<std::vector<std::uint8_t>> fetch_url(const std::string& url, const std::string& accept);

}  // namespace tind
