#pragma once
// Reads whole answers of HTTP or HTTPS, to look at tile sets on servers; only a URL that the caller
// names. What is read by ranges (archives, DEMs) and object stores: remote/objects.h. GDAL's own
// remote files stay disabled for every raster (gdal_setup.cpp).

#include <cstdint>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind {

class UrlReader {
 public:
  virtual ~UrlReader() = default;

  /// The body behind a URL, unpacked where the server compressed it for the way; 64 MiB at most.
  /// not_found for 404 and 410, io for whatever else is not 200. `accept` is sent as it is, and
  /// `key`, where there is one, as a bearer's, but to no server that the first one names instead.
  /// Thread-safe. Blocks for 30 s at most.
  virtual Result<std::vector<std::uint8_t>> read(const std::string& url, const std::string& accept,
                                                 const std::string& key) const = 0;
};

/// GDAL's, which keeps connections and uses them again.
const UrlReader& gdal_url_reader();

}  // namespace tind
