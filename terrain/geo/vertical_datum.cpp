#include "terrain/geo/vertical_datum.h"

#include <fmt/format.h>

namespace tind {

std::string name(const VerticalDatum& datum) {
  switch (datum.kind()) {
    case VerticalDatum::ellipsoid:
      return "ellipsoid";
    case VerticalDatum::egm84:
      return "egm84";
    case VerticalDatum::egm96:
      return "egm96";
    case VerticalDatum::egm2008:
      return "egm2008";
    case VerticalDatum::crs:
      return datum.text();
    case VerticalDatum::file:
      return datum.text().substr(datum.text().rfind('/') + 1);
    case VerticalDatum::unknown:
      break;
  }
  return "unknown";
}

std::string text(const VerticalAccuracy& accuracy) {
  std::string metres = fmt::format("{:.6g} m", accuracy.metres);
  if (accuracy.kind != AccuracyKind::unspecified) metres += " (" + name_of(accuracy.kind) + ")";
  return metres;
}

}  // namespace tind
