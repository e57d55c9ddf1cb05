#pragma once
// What heights are above.

#include <cstdint>
#include <string>
#include <utility>

#include "terrain/base/enum_names.h"

namespace tind {

/// A vertical datum by its name. `unknown` is one, too: nobody says.
class VerticalDatum {
 public:
  /// `crs`: a vertical or compound CRS, as PROJ knows it (EPSG:5703); `file`: a grid of somebody's
  /// geoid.
  enum Kind : std::uint8_t { unknown, ellipsoid, egm96, egm84, egm2008, crs, file };

  VerticalDatum(Kind kind = unknown) : kind_(kind) {}
  /// `text`: the name of the CRS or the file, else of the grid that the model is to be taken from
  /// ("egm96-5"; empty: whichever there is).
  VerticalDatum(Kind kind, std::string text) : kind_(kind), text_(std::move(text)) {}

  Kind kind() const { return kind_; }
  const std::string& text() const { return text_; }

  /// A model is the same from any grid.
  friend bool operator==(const VerticalDatum& a, const VerticalDatum& b) {
    return a.kind_ == b.kind_ && (a.kind_ < crs || a.text_ == b.text_);
  }

 private:
  Kind kind_ = unknown;
  std::string text_;
};

/// As outputs have it: "unknown", "ellipsoid", "egm84", "egm96", "egm2008", "EPSG:5703", or a
/// file's name without its folder.
std::string name(const VerticalDatum&);

/// What heights are to be brought to.
struct TargetDatum {
  /// `ellipsoid_if_known`: heights of unknown datum stay as they are, with a warning.
  enum Kind : std::uint8_t { same, ellipsoid, ellipsoid_if_known, datum };

  TargetDatum(Kind to = same) : kind(to) {}
  /// REQUIRES: not unknown.
  TargetDatum(VerticalDatum to)
      : kind(to == VerticalDatum::ellipsoid ? ellipsoid : datum), named(std::move(to)) {}

  Kind kind = same;
  VerticalDatum named;  // of `datum`

  friend bool operator==(const TargetDatum&, const TargetDatum&) = default;
};

enum class AccuracyKind { unspecified, le90, le95, rmse };
template <>
struct EnumNames<AccuracyKind> {
  static constexpr const char* kWhat = "kind of accuracy";
  static constexpr std::pair<AccuracyKind, const char*> kAll[] = {
      {AccuracyKind::unspecified, "unspecified"},
      {AccuracyKind::le90, "le90"},
      {AccuracyKind::le95, "le95"},
      {AccuracyKind::rmse, "rmse"}};
};

/// How far a dataset's heights are from the ground, as its maker states it.
struct VerticalAccuracy {
  AccuracyKind kind = AccuracyKind::unspecified;
  double metres = 0;
  friend bool operator==(const VerticalAccuracy&, const VerticalAccuracy&) = default;
};

/// For people: "4 m (le90)".
std::string text(const VerticalAccuracy&);

}  // namespace tind
