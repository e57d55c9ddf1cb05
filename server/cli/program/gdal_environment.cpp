#include "server/cli/program/gdal_environment.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

namespace tind::cli {

void forget_gdal_options() {
  constexpr std::string_view kOfGdal[] = {"AAIGRID_", "CPL_",  "DTED_", "EHDR_", "GDAL_",
                                          "GTIFF_",   "HFA_",  "OGR_",  "OSR_",  "PNG_",
                                          "SRTMHGT_", "TIFF_", "VRT_",  "VSI_",  "USGSDEM_"};
  constexpr std::string_view kKept[] = {
      "GDAL_CACHEMAX",          "GDAL_DATA",       "GDAL_HTTP_PROXY",    "GDAL_HTTPS_PROXY",
      "GDAL_HTTP_PROXYUSERPWD", "GDAL_PROXY_AUTH", "GDAL_CURL_CA_BUNDLE"};
  std::vector<std::string> gone;
  for (char** one = environ; one && *one; ++one) {
    const std::string_view name =
        std::string_view(*one).substr(0, std::string_view(*one).find('='));
    const bool of_gdal = std::ranges::any_of(
        kOfGdal, [&](std::string_view start) { return name.starts_with(start); });
    if (of_gdal && std::ranges::find(kKept, name) == std::end(kKept)) gone.emplace_back(name);
  }
  // NOLINTNEXTLINE(concurrency-mt-unsafe): there are no threads yet
  for (const std::string& name : gone) unsetenv(name.c_str());
}

}  // namespace tind::cli
