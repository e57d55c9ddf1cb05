#pragma once
// GeoPackage records when it was written; the same content is to be the same bytes.

#include <cpl_conv.h>

namespace tind::gdal {

/// While it lives, this thread's files are of 1970.
class FixedDate {
 public:
  FixedDate() { CPLSetThreadLocalConfigOption("OGR_CURRENT_DATE", "1970-01-01T00:00:00.000Z"); }
  ~FixedDate() { CPLSetThreadLocalConfigOption("OGR_CURRENT_DATE", nullptr); }
  FixedDate(const FixedDate&) = delete;
  FixedDate& operator=(const FixedDate&) = delete;
};

}  // namespace tind::gdal
