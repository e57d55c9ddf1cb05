#include "server/api/ogc/edr_query.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "server/api/crs_name.h"
#include "server/api/elevation/places.h"
#include "server/api/ogc/asked_crs.h"
#include "server/http/message/media_choice.h"
#include "server/http/message/query_numbers.h"

namespace tind::api::ogc {
namespace {

using proto::WktType;

bool anything(std::string_view) { return true; }

/// Of a length in a query, metres.
constexpr std::pair<std::string_view, double> kUnits[] = {
    {"m", 1}, {"km", 1000}, {"ft", 0.3048}, {"mi", 1609.344}, {"nmi", 1852}};
const std::vector<std::string_view> kUnitWords = {"m", "km", "ft", "mi", "nmi"};

/// Whose places are these, as its WKT may be.
std::vector<WktType> types_of(EdrShape shape) {
  switch (shape) {
    case EdrShape::position:
      return {WktType::point, WktType::multi_point};
    case EdrShape::trajectory:
    case EdrShape::corridor:
      return {WktType::line_string, WktType::multi_line_string};
    case EdrShape::area:
      return {WktType::polygon, WktType::multi_polygon};
    case EdrShape::cube:
      break;
  }
  return {};
}

/// Where: coords of a shape, the bbox of a cube.
http::QueryWord place_word(EdrShape shape) {
  http::QueryWord word = {.name = "coords", .words = {}, .fits = anything, .form = "WKT"};
  switch (shape) {
    case EdrShape::position:
      word.pattern = "^POINT\\(-?[1-9][0-9] [1-8][0-9]\\)$";
      word.example = "POINT(-121.76 46.85)";
      break;
    case EdrShape::trajectory:
    case EdrShape::corridor:
      word.pattern = "^LINESTRING\\(-121\\.[5-9] 46\\.[7-9],-121\\.[5-9] 46\\.[7-9]\\)$";
      word.example = "LINESTRING(-121.78 46.84,-121.74 46.87)";
      break;
    case EdrShape::area:
      word.pattern =
          "^POLYGON\\(\\(-121\\.8 46\\.8,-121\\.7 46\\.8,-121\\.[5-9] 46\\.9,-121\\.8 "
          "46\\.8\\)\\)$";
      word.example = "POLYGON((-121.78 46.84,-121.74 46.84,-121.74 46.87,-121.78 46.84))";
      break;
    case EdrShape::cube:
      word = {.name = "bbox",
              .words = {},
              .fits = anything,
              .form = "west,south,east,north in the order of the axes of crs",
              .pattern = "^-121\\.[7-9],46\\.[78],-121\\.[56],46\\.9$",
              .example = "-121.78,46.84,-121.74,46.87"};
  }
  return word;
}

std::vector<http::QueryWord> words_of(EdrShape shape) {
  std::vector<http::QueryWord> words = {{"f", {"CoverageJSON", "GeoJSON", "json"}},
                                        {"crs", {"CRS84"}, is_crs_name, kCrsForm},
                                        {"parameter-name", {"height"}},
                                        place_word(shape),
                                        {"z", {}, anything},
                                        {"datetime", {}, anything}};
  for (const http::QueryWord& word : height_words()) words.push_back(word);
  if (shape == EdrShape::corridor) {
    for (const char* name : {"width-units", "height-units"})
      words.push_back({.name = name, .words = kUnitWords, .example = "km"});
  }
  return words;
}
constexpr std::size_t kHeightWords = 6, kUnitsAt = 9;  // in those

std::vector<http::QueryNumber> numbers_of(EdrShape shape) {
  constexpr double kMost = double(kMostPlaces);
  std::vector<http::QueryNumber> numbers;
  if (shape == EdrShape::position) return numbers;
  numbers.push_back({"resolution-x", 0, kMost, "a number of positions", true});
  if (shape == EdrShape::trajectory) return numbers;
  numbers.push_back({"resolution-y", 0, kMost, "a number of positions", true});
  if (shape != EdrShape::corridor) return numbers;
  for (const char* name : {"corridor-width", "corridor-height"})
    numbers.push_back({name, 0, 1e6, "a length", false, {}, "1"});
  return numbers;
}

struct Reading {
  EdrQuery query;
  std::vector<http::ParameterProblem> problems;

  void wrong(std::string parameter, std::string detail) {
    problems.push_back({std::move(parameter), std::move(detail)});
  }
};

void read_coords(const std::string& text, Reading& r) {
  const auto types = types_of(r.query.shape);
  const std::string kinds = fmt::format("WKT, {} or {}", name(types[0]), name(types[1]));
  if (text.empty()) return r.wrong("coords", "missing: " + kinds);
  auto coords = proto::decode_wkt(text, kMostPlaces);
  if (!coords) return r.wrong("coords", coords.error().what);
  if (std::ranges::find(types, coords->type) == types.end())
    return r.wrong("coords", fmt::format("must be {}, not {}", kinds, name(coords->type)));
  r.query.coords = std::move(*coords);
}

void read_bbox(const std::string& text, Reading& r) {
  if (text.empty()) return r.wrong("bbox", "missing: four numbers with commas between");
  if (const auto box = four_numbers(text))
    r.query.bbox = *box;
  else
    r.wrong("bbox", "must be four numbers (or six, with heights) with commas between");
}

void read_corridor(const http::QueryNumbers& read, Reading& r) {
  constexpr const char* kLengths[] = {"corridor-width", "corridor-height"};
  constexpr const char* kUnitNames[] = {"width-units", "height-units"};
  for (std::size_t k = 0; k < 2; ++k) {
    if (!read.values[2 + k]) r.wrong(kLengths[k], "missing: a length");
    if (read.words[kUnitsAt + k].empty())
      r.wrong(kUnitNames[k], fmt::format("missing: {}", fmt::join(kUnitWords, ", ")));
  }
  if (!r.problems.empty()) return;
  const auto unit =
      std::ranges::find(kUnits, read.words[kUnitsAt], &std::pair<std::string_view, double>::first);
  r.query.width_m = *read.values[2] * unit->second;
  if (!(r.query.width_m > 0)) r.wrong("corridor-width", "must be more than 0");
}

/// Both ends are among them.
void read_resolution(const http::QueryNumbers& read, std::span<const http::QueryNumber> numbers,
                     Reading& r) {
  int* const counts[] = {&r.query.along, &r.query.across};
  for (std::size_t k = 0; k < std::min<std::size_t>(2, numbers.size()); ++k) {
    *counts[k] = int(read.values[k].value_or(0));
    if (*counts[k] == 1) r.wrong(std::string(numbers[k].name), "must be 0 or at least 2");
  }
}

/// `z` beside coordinates that have their own.
void check_levels(const std::string& z, Reading& r) {
  if (!z.empty() && r.query.coords.has_z)
    r.wrong("z", "and the Z of coords are two levels: leave one out (neither counts here)");
}

bool wants_geojson(const std::string& f, const http::Fields& fields) {
  constexpr std::string_view kTypes[] = {"application/prs.coverage+json", "application/json",
                                         "application/vnd.cov+json", "application/geo+json"};
  return f.empty() ? http::preferred_type(fields, kTypes) == 3 : f == "GeoJSON";
}

}  // namespace

std::expected<EdrQuery, std::vector<http::ParameterProblem>> read_edr_query(
    EdrShape shape, std::string_view query, const http::Fields& fields) {
  const auto words = words_of(shape);
  const auto numbers = numbers_of(shape);
  auto read = http::read_numbers(query, numbers, words);
  Reading r;
  r.problems = std::move(read.problems);
  r.query.shape = shape;
  if (shape == EdrShape::cube)
    read_bbox(read.words[3], r);
  else
    read_coords(read.words[3], r);
  check_levels(read.words[4], r);
  read_resolution(read, numbers, r);
  if (shape == EdrShape::corridor) read_corridor(read, r);
  if (!r.problems.empty()) return std::unexpected(std::move(r.problems));

  r.query.geojson = wants_geojson(read.words[0], fields);
  if (!read.words[1].empty()) r.query.crs = *crs_named(read.words[1]);
  r.query.question = height_question(std::span(read.words).subspan(kHeightWords, 3));
  return std::move(r.query);
}

http::Operation edr_operation(EdrShape shape) {
  constexpr const char* kCoverage = R"({
    "type": "object",
    "required": ["type"],
    "properties": {
      "type": {"const": "Coverage"}, "domain": {"type": "object"},
      "parameters": {"type": "object"}, "ranges": {"type": "object"},
      "tind:max_error_m": {"type": "number", "description": "of the meshes that were asked"},
      "tind:max_off_m": {"type": "number",
                         "description": "of all values, also between posts, from the DEM's"}
    }})";
  constexpr const char* kFeatures = R"({
    "type": "object",
    "required": ["type", "features"],
    "properties": {
      "type": {"const": "FeatureCollection"}, "parameters": {"type": "object"},
      "features": {"type": "array", "items": {"$ref": "#/components/schemas/GeoJson"}},
      "tind:max_error_m": {"type": "number", "description": "of the meshes that were asked"},
      "tind:max_off_m": {"type": "number",
                         "description": "of all values, also between posts, from the DEM's"}
    }})";
  static const std::pair<const char*, const char*> kTexts[] = {
      {"getPosition", "Heights at places"},
      {"getTrajectory", "Heights along lines"},
      {"getCorridor", "Heights along lines, as far as a width"},
      {"getArea", "Heights in polygons"},
      {"getCube", "Heights in a rectangle"}};
  const auto& [id, summary] = kTexts[std::size_t(shape)];
  return {.id = id,
          .tag = "OGC",
          .summary = summary,
          .numbers = numbers_of(shape),
          .words = words_of(shape),
          .responses = {{200,
                         "The heights.",
                         {{"application/prs.coverage+json", kCoverage},
                          {"application/geo+json", kFeatures}}}}};
}

}  // namespace tind::api::ogc
