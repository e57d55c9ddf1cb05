#pragma once
// CoverageJSON (OGC 21-069r2) as it is written: one parameter over a regular grid or at places.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tind::proto {

/// `count` numbers at equal distances, both ends among them.
struct CoverageAxis {
  double first = 0, last = 0;
  int count = 1;
};

struct CoverageParameter {
  std::string name;                                    // "height"
  std::string description;                             // "Height above egm96"
  std::string unit_name = "metre", unit_symbol = "m";  // the symbol as UCUM has it
  std::string property, property_name;                 // what is observed: a URI, and in words
};

struct CoverageJson {
  // A grid, its values in rows of `x`, in the order of `y`; or places, if there are any.
  CoverageAxis x, y;
  std::vector<std::array<double, 2>> places;  // x (east) and y (north)
  bool point = false;                         // the one place is the domain, not a list of one

  std::string crs;         // its URI
  bool geographic = true;  // else projected
  bool east_first = true;  // are its axes in the order x, y?
  CoverageParameter parameter;
  std::span<const double> values;     // NaN where there is none
  std::optional<double> max_error_m;  // tind's own: how far values can be from the posts
  std::optional<double> off_m;        // tind's own: how far from the surface between these
};

/// The parameter as CoverageJSON and OGC API - EDR have it: {"type": "Parameter", ...}.
std::string encode_parameter(const CoverageParameter&);

/// Numbers in as many digits as tell them from all others. REQUIRES: as many values as places, or
/// as the grid has.
std::string encode_coverage_json(const CoverageJson&);

}  // namespace tind::proto
