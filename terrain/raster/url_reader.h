#pragma once
// Reads files by HTTP or HTTPS, to look at tile sets on servers. This is the one interface through
// which terrain/ talks to servers. DEMs are never read this way: remote files stay disabled for
// every raster (gdal_setup.cpp), and only a URL that the caller names is read.

#include <cstdint>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind {

class UrlReader {
 public:
  virtual ~UrlReader() = default;

  /// The body behind a URL, unpacked where the server compressed it for the way; 64 MiB at most.
  /// not_found for 404 and 410, io for whatever else is not 200. `accept` is sent as it is.
  /// Thread-safe. Blocks for 30 s at most.
  virtual Result<std::vector<std::uint8_t>> read(const std::string& url,
                                                 const std::string& accept) const = 0;
};

/// GDAL's, which keeps connections and uses them again.
const UrlReader& gdal_url_reader();

}  // namespace tind
