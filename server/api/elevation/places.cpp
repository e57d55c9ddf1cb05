#include "server/api/elevation/places.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <utility>

#include "proto/csv.h"
#include "proto/json_text.h"
#include "server/api/accuracy_json.h"
#include "server/api/json_problem.h"
#include "server/api/members.h"
#include "server/http/message/problem.h"
#include "terrain/raster/crs_points.h"
#include "terrain/surface/stated_accuracy.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;

constexpr std::size_t kMostListValues = 3 * kMostPlaces + 2;  // pairs in a list in an object
const std::string kTooMany = "must have at most " + std::to_string(kMostPlaces) + " places";
const std::string kLackTooMany = "has lines that lack more than " + std::to_string(kMostLacking) +
                                 " fields of the first line in all";

std::optional<Vec2> position(const Ordered& json) {
  if (!json.is_array() || json.size() < 2 || !json[0].is_number() || !json[1].is_number())
    return {};
  const Vec2 p{json[0].get<double>(), json[1].get<double>()};
  if (!std::isfinite(p.x) || !std::isfinite(p.y)) return {};
  return p;
}

/// {"locations": [[x, y], ...]}
class PlaceList final : public PlacesDocument {
 public:
  PlaceList(const Ordered& json, Problems& problems) { read_list(json, problems); }

  bool east_first() const override { return false; }
  std::string name_of(std::size_t i) const override {
    return "locations[" + std::to_string(i) + "]";
  }
  std::string_view media_type() const override { return "application/json"; }

  std::string with_heights(const HeightsMade& made) override {
    Ordered json = about(made);
    Ordered heights = Ordered::array(), coverage = Ordered::array();
    for (const PlaceHeight& place : made.heights.places) {
      heights.push_back(height_json(place.height));
      coverage.push_back(word(place.height.coverage));
    }
    json["height_m"] = std::move(heights);
    json["coverage"] = std::move(coverage);
    if (made.question.level) {
      for (const PlaceHeight& place : made.heights.places) {
        json["tile"].push_back(place.tile ? Ordered(place.tile->text()) : Ordered(nullptr));
        json["max_error_m"].push_back(place.max_error_m ? Ordered(*place.max_error_m)
                                                        : Ordered(nullptr));
        const auto between = height_between(place);
        json["low_m"].push_back(between ? Ordered(between->first) : Ordered(nullptr));
        json["high_m"].push_back(between ? Ordered(between->second) : Ordered(nullptr));
      }
    } else if (!made.dataset.source->only()) {
      for (const PlaceHeight& place : made.heights.places)
        json["layer"].push_back(place.height.coverage == Coverage::value
                                    ? Ordered(made.dataset.source->layers()[place.layer].name)
                                    : Ordered(nullptr));
    }
    return json::to_text(json) + "\n";
  }

 private:
  void read_list(const Ordered& json, Problems& problems) {
    Json names = Json::object();  // without what they name: a copy of that takes as much again
    for (const auto& [name, value] : json.items()) names[name] = nullptr;
    Members members(names, "", problems);
    const bool there = members.member("locations", Members::Need::must);
    members.nothing_else();
    if (!there) return;
    const Ordered& list = json["locations"];
    if (!list.is_array() || list.empty())
      return problems.add("locations", "must be a list of pairs of numbers");
    if (list.size() > kMostPlaces) return problems.add("locations", kTooMany);
    for (std::size_t i = 0; i < list.size(); ++i) {
      const auto at = position(list[i]);
      if (!at || list[i].size() != 2)
        problems.add(name_of(i), "must be a pair of numbers");
      else
        coordinates_.push_back(*at);
    }
  }
};

/// Any object of RFC 7946.
class GeoJsonPlaces : public PlacesDocument {
 public:
  GeoJsonPlaces(Ordered json, Problems& problems) : json_(std::move(json)) {
    each_geometry(json_, [this](Ordered& coordinates) {
      each_of(coordinates, [this](Ordered& json_position) {
        const auto at = position(json_position);
        if (at && coordinates_.size() < kMostPlaces)
          coordinates_.push_back(*at);
        else if (!at)
          bad_ = true;
        else
          many_ = true;
      });
    });
    if (many_)
      problems.add("coordinates", kTooMany);
    else if (bad_ || (coordinates_.empty() && !may_be_empty()))
      problems.add("coordinates",
                   "must be positions of GeoJSON: [lon, lat], or nested lists of them");
  }

  bool east_first() const override { return true; }
  std::string name_of(std::size_t i) const override { return "position " + std::to_string(i + 1); }
  std::string_view media_type() const override { return "application/geo+json"; }

  std::string with_heights(const HeightsMade& made) override {
    const auto heights = std::span<const PlaceHeight>(made.heights.places);
    const auto lacks = [](const PlaceHeight& p) { return p.height.coverage != Coverage::value; };
    std::size_t next = 0;
    each_geometry(json_, [&](Ordered& coordinates) {
      std::size_t count = 0;
      each_of(coordinates, [&](Ordered&) { ++count; });
      const auto own = heights.subspan(next, count);
      next += count;
      // Readers take a missing number among others for 0.
      const bool whole = std::ranges::none_of(own, lacks);
      std::size_t i = 0;
      each_of(coordinates, [&](Ordered& json_position) {
        json_position.erase(json_position.begin() + 2, json_position.end());
        if (whole) json_position.push_back(own[i].height.height_m);
        ++i;
      });
    });
    json_["heights"] = about(made);
    if (std::ranges::any_of(heights, lacks)) {
      Ordered& all = json_["heights"]["height_m"] = Ordered::array();
      for (const PlaceHeight& p : heights) all.push_back(height_json(p.height));
    }
    return json::to_text(json_) + "\n";
  }

 private:
  Ordered json_;
  bool bad_ = false, many_ = false;

  /// A collection of nothing is one of no heights.
  bool may_be_empty() const {
    if (json_.contains("geometry")) return true;
    for (const char* const list : {"features", "geometries", "coordinates"})
      if (const auto found = json_.find(list); found != json_.end() && found->is_array())
        return true;
    return false;
  }

  template <class Visit>
  static void each_of(Ordered& coordinates, const Visit& visit) {
    const bool nested = coordinates.is_array() && !coordinates.empty() && coordinates[0].is_array();
    if (!nested) return visit(coordinates);
    for (Ordered& part : coordinates) each_of(part, visit);
  }

  /// The coordinates of a geometry, of all in a feature or collection.
  template <class Visit>
  static void each_geometry(Ordered& object, const Visit& visit) {
    if (!object.is_object()) return;
    if (const auto found = object.find("coordinates"); found != object.end())
      if (!found->is_array() || !found->empty()) visit(*found);
    if (const auto found = object.find("geometry"); found != object.end())
      each_geometry(*found, visit);
    for (const char* const list : {"features", "geometries"})
      if (const auto found = object.find(list); found != object.end() && found->is_array())
        for (Ordered& part : *found) each_geometry(part, visit);
  }
};

/// Lines of a table; each with a place.
class CsvPlaces : public PlacesDocument {
 public:
  CsvPlaces(std::string_view body, bool degrees, Problems& problems, const std::stop_token& stop)
      : degrees_(degrees) {
    read_table(body, problems, stop);
  }

  bool east_first() const override { return true; }
  std::string name_of(std::size_t i) const override {
    return "line " + std::to_string(lines_[i].number);
  }
  std::string_view media_type() const override { return "text/csv"; }

  std::string with_heights(const HeightsMade& made) override {
    std::string text;
    text.reserve(head_.size() + read_ + lacking_ + kUsualAnswer * (lines_.size() + 1));
    ((text += head_) += ',') += made.question.level ? kAllColumns : kColumns;
    text += '\n';
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      const PlaceHeight& place = made.heights.places[i];
      (text += lines_[i].text).append(lines_[i].lacks + 1, ',');
      if (place.height.coverage == Coverage::value) text += Ordered(place.height.height_m).dump();
      (text += ',') += word(place.height.coverage);
      if (made.question.level) {
        text += ',';
        if (place.max_error_m) text += Ordered(*place.max_error_m).dump();
        const auto between = height_between(place);
        text += between
                    ? ',' + Ordered(between->first).dump() + ',' + Ordered(between->second).dump()
                    : ",,";
      }
      text += '\n';
    }
    return text;
  }

 private:
  static constexpr const char* kColumns = "height_m,coverage";
  static constexpr const char* kAllColumns = "height_m,coverage,max_error_m,low_m,high_m";
  static constexpr std::size_t kUsualAnswer = 32;  // bytes behind a line

  struct Line {
    std::string_view text;  // of the body
    std::size_t number;     // from 1
    std::size_t lacks;      // fields that the head has
  };

  std::string_view head_;
  std::vector<Line> lines_;
  std::size_t read_ = 0, lacking_ = 0;  // bytes and missing fields of all lines
  bool degrees_;
  csv::PlaceColumns columns_;

  void read_table(std::string_view body, Problems& problems, const std::stop_token& stop) {
    if (body.starts_with("\xef\xbb\xbf")) body.remove_prefix(3);
    for (std::size_t number = 1; !body.empty() && !stop.stop_requested(); ++number) {
      const std::size_t end = std::min(body.find('\n'), body.size());
      std::string_view line = body.substr(0, end);
      body.remove_prefix(std::min(end + 1, body.size()));
      if (line.ends_with('\r')) line.remove_suffix(1);
      if (line.empty()) continue;
      if (head_.empty()) {
        head_ = line;
        if (!find_columns(problems)) return;
      } else if (coordinates_.size() == kMostPlaces) {
        return problems.add("body", kTooMany);
      } else {
        read_line(line, number, problems);
      }
    }
    if (lacking_ > kMostLacking) problems.add("body", kLackTooMany);
    if (problems.empty() && coordinates_.empty()) problems.add("body", "has no line with a place");
  }

  bool find_columns(Problems& problems) {
    if (csv::has_open_quote(head_)) {
      problems.add("line 1", csv::kOpenQuote);
      return false;
    }
    const auto found = csv::PlaceColumns::in(head_, degrees_);
    if (!found) {
      problems.add("body", "its first line " + found.error().what);
      return false;
    }
    columns_ = *found;
    const std::string why = csv::why_no_columns(head_, kAllColumns);
    if (!why.empty()) problems.add("body", why);
    return why.empty();
  }

  void read_line(std::string_view line, std::size_t number_of_line, Problems& problems) {
    if (csv::has_open_quote(line))
      return problems.add("line " + std::to_string(number_of_line), csv::kOpenQuote);
    const csv::PlaceFields place = columns_.of(line);
    if (!place.x || !place.y)
      return problems.add("line " + std::to_string(number_of_line), "has no two coordinates");
    if (place.count > columns_.count)
      return problems.add("line " + std::to_string(number_of_line), csv::kTooWide);
    coordinates_.push_back({*place.x, *place.y});
    lines_.push_back({line, number_of_line, columns_.count - place.count});
    read_ += line.size(), lacking_ += lines_.back().lacks;
  }
};

std::string why_no_object(std::string_view body, bool is_json) {
  if (is_json) return "must be a JSON object";
  if (json::most_members(body) <= json::kMostOrderedMembers) return why_no_json(body);
  return "must have at most " + std::to_string(json::kMostOrderedMembers) + " members in an object";
}

/// Null where there are problems, or where it is to stop.
std::unique_ptr<PlacesDocument> read_any_json(std::string_view body, Problems& problems,
                                              const std::stop_token& stop) {
  const std::size_t values = json::count_values(body);
  if (values > kMostValues) {
    problems.add("body", "must have at most " + std::to_string(kMostValues) + " JSON values");
    return {};
  }
  if (stop.stop_requested()) return {};
  auto json = json::parse<Ordered>(body);
  if (stop.stop_requested()) return {};
  if (!json.is_object())
    problems.add("body", why_no_object(body, !json.is_discarded()));
  else if (!has_names_once(body, json::values_of(json), problems))
    return {};
  else if (json.contains("type"))
    return std::make_unique<GeoJsonPlaces>(std::move(json), problems);
  else if (values > kMostListValues)
    problems.add("locations", kTooMany);
  else
    return std::make_unique<PlaceList>(json, problems);
  return {};
}

}  // namespace

Ordered about(const HeightsMade& made) {
  Ordered json = {{"source", made.dataset.name}, {"datum", made.heights.datum}};
  if (made.question.level)
    json["surface"] = "level=" + std::to_string(*made.question.level);
  else
    json["interpolation"] = name_of(made.question.interpolation);
  const auto stated = made.question.level ? made.dataset.tiles->layer().accuracy
                                          : stated_accuracy(*made.dataset.source);
  if (!stated.empty()) json["accuracy"] = accuracies_json(stated);
  return json;
}

std::expected<std::unique_ptr<PlacesDocument>, http::Reply> PlacesDocument::read(
    std::string_view type, std::string_view body, const std::string& crs, std::string_view target,
    const std::stop_token& stop) {
  Problems problems;
  std::unique_ptr<PlacesDocument> read;
  if (type == "text/csv")
    read = std::make_unique<CsvPlaces>(body, is_geographic(crs), problems, stop);
  else
    read = read_any_json(body, problems, stop);
  if (stop.stop_requested())
    return std::unexpected(http::problem_reply(Error{Errc::cancelled, "stopped"}, target));
  if (!problems.empty()) return std::unexpected(http::problem_reply(problems.list(), target));
  return read;
}

}  // namespace tind::api
