#pragma once
// What a reference system's WKT says, for formats that name it in their own way.

#include <string>

#include "terrain/base/result.h"

namespace tind {

struct CrsCode {
  /// The EPSG code that the text names, or that of the one system which PROJ's list knows to be the
  /// same. 0: there is none.
  int epsg = 0;
  bool geographic = false;
  double unit_m = 1;                // metres per unit, where not geographic
  std::string name = {}, wkt = {};  // WKT 2
};

/// Of a horizontal system, as WKT or "EPSG:n". All zero where the text is no CRS. Errc::io where
/// PROJ's database cannot be read. Milliseconds.
Result<CrsCode> crs_code(const std::string& text);

}  // namespace tind
