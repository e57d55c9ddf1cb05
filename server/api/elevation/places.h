#pragma once
// Places as clients send them by the thousand, as JSON, GeoJSON or CSV; and the same document with
// their heights.

#include <expected>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>

#include "server/api/elevation/heights.h"
#include "server/http/message/reply.h"
#include "terrain/geo/coordinates.h"

namespace tind::api {

inline constexpr std::size_t kMostPlaces = 100'000;
/// Of one document of JSON, so that what is made of it in memory has a bound, too: places with
/// several properties each.
inline constexpr std::size_t kMostValues = 10 * kMostPlaces;
/// Fields that the lines of a table lack of its head line, all together: each is a comma of the
/// answer, so that a long head above many short lines would be gigabytes of them.
inline constexpr std::size_t kMostLacking = 8u << 20;
inline constexpr std::string_view kPlacesTypes = "application/json, application/geo+json, text/csv";

/// What an answer says once, about all of its heights.
struct HeightsMade {
  const services::ServedDataset& dataset;
  const HeightQuestion& question;
  const Heights& heights;  // in the order of the coordinates
};

/// What was sent, read.
///
/// JSON: {"locations": [[x, y], ...]}; the answer has a list each of heights and coverages.
/// GeoJSON: any object; each position of the answer has its height as third number, and stays
/// without where there is none. CSV: a head line with columns lon and lat (or longitude, latitude;
/// x, y; easting, northing); the answer has the same lines with the columns height_m and coverage.
class PlacesDocument {
 public:
  virtual ~PlacesDocument() = default;

  /// `type`: one of kPlacesTypes. At least one place and at most kMostPlaces, all numbers finite.
  /// `crs`: what they are asked for in, which says which columns of a table they are. The error is
  /// the reply that says what is wrong. `target`: of the request. REQUIRES: `body` stays as long as
  /// the document, for the lines of a table are not copied.
  static std::expected<std::unique_ptr<PlacesDocument>, http::Reply> read(std::string_view type,
                                                                          std::string_view body,
                                                                          const std::string& crs,
                                                                          std::string_view target,
                                                                          const std::stop_token&);

  std::span<const Vec2> coordinates() const { return coordinates_; }
  /// Do they stand as x before y, east before north, whatever the authority of their CRS has? So
  /// do GeoJSON, and columns that have names.
  virtual bool east_first() const = 0;
  /// What `place` is called in what was sent, for a person: "locations[3]", "line 7".
  virtual std::string name_of(std::size_t place) const = 0;
  virtual std::string_view media_type() const = 0;
  /// REQUIRES: heights of all coordinates; once.
  virtual std::string with_heights(const HeightsMade&) = 0;

 protected:
  std::vector<Vec2> coordinates_;
};

/// Members of an answer that say what its heights are: source, datum, and what else holds for all.
nlohmann::ordered_json about(const HeightsMade&);

}  // namespace tind::api
