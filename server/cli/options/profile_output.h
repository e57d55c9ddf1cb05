#pragma once
// A profile as text: CSV, GeoJSON, JSON, CoverageJSON.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "terrain/analysis/profile.h"
#include "terrain/base/enum_names.h"
#include "terrain/base/result.h"

namespace tind::cli {

enum class ProfileFormat { csv, geojson, json, covjson };

}  // namespace tind::cli

namespace tind {
template <>
struct EnumNames<cli::ProfileFormat> {
  static constexpr const char* kWhat = "format";
  static constexpr std::pair<cli::ProfileFormat, const char*> kAll[] = {
      {cli::ProfileFormat::csv, "csv"},
      {cli::ProfileFormat::geojson, "geojson"},
      {cli::ProfileFormat::json, "json"},
      {cli::ProfileFormat::covjson, "covjson"}};
};
}  // namespace tind

namespace tind::cli {

/// By the extension, any case. Fails (invalid_argument) with what there is.
Result<ProfileFormat> profile_format(const std::string& path);

/// What is said of all of its heights.
struct ProfileFacts {
  std::string datum;
  /// Each height is within so many metres of this; none: no such thing is known.
  std::optional<double> bound_m;
  bool bound_at_posts_only = false;  // between posts it may be farther off
};

/// Where there is no height: an empty cell, null, a position of two numbers. CoverageJSON: a
/// MultiPoint domain in CRS84, a range a column.
std::string profile_text(ProfileFormat, const Profile&, const ProfileFacts&);

/// What is said of one that went into a file: how many places it has, and how many without height.
nlohmann::ordered_json profile_summary(const std::string& path, const Profile&,
                                       const ProfileFacts&);
/// The same for people, a line.
std::string profile_summary_line(const nlohmann::ordered_json&);

}  // namespace tind::cli
