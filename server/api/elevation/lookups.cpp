#include "server/api/elevation/lookups.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "proto/polyline.h"
#include "server/api/elevation/heights.h"
#include "server/api/elevation/places.h"
#include "server/http/message/uri.h"

namespace tind::api {
namespace {

/// Longer ones are a batch, which keeps no question waiting.
constexpr std::size_t kQuickly = 20'000;  // bytes

double spacing_m(const services::ServedDataset& dataset) {
  const DemInfo& info = dataset.source->info();
  return std::max(info.spacing_x_m, info.spacing_y_m);
}

/// Blanks around numbers count for nothing; forms send them as plus signs.
std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " +\t";
  text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
  return text.substr(0, text.find_last_not_of(kBlank) + 1);
}

std::optional<double> number_of(std::string_view text) {
  text = trimmed(text);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

std::optional<Geographic> place_of_text(std::string_view text) {
  const auto comma = text.find(',');
  if (comma == text.npos) return {};
  const auto lat = number_of(text.substr(0, comma)), lon = number_of(text.substr(comma + 1));
  if (!lat || !lon) return {};
  return Geographic{*lon, *lat};
}

bool may_hold(const services::ServedDataset& dataset, const Geographic& p) {
  const GeoRect bounds = dataset.facts().bounds;
  for (const double turn : {-360.0, 0.0, 360.0})
    if (bounds.contains({p.lon + turn, p.lat})) return true;
  return false;
}

/// At least two for each place but the last, however places are written: commas and bars of a
/// list, the last characters of both numbers of a polyline, commas of JSON.
std::size_t marks_of(std::string_view text) {
  return std::size_t(std::ranges::count_if(
      text, [](char c) { return c == ',' || c == '|' || (c >= '?' && c <= '^'); }));
}

std::string too_many() { return fmt::format("at most {} places in one request", kMostPlaces); }

}  // namespace

http::QueryWord locations_word() {
  return {.name = "locations",
          .words = {},
          .form = "lat,lon|lat,lon or an encoded polyline",
          .about = "the places, latitude first",
          .pattern = "^-?[0-8]?[0-9](\\.[0-9]{1,6})?,-?1?[0-7]?[0-9](\\.[0-9]{1,6})?$",
          .example = "46.85,-121.76|46.9,-121.8"};
}

Datasets all_finest_first(const App& app, const http::Request& request) {
  Datasets all = app.catalog.all();
  std::erase_if(
      all, [&](const auto& dataset) { return !dataset->source || !request.sees(dataset->name); });
  std::ranges::stable_sort(all, {}, [](const auto& dataset) { return spacing_m(*dataset); });
  return all;
}

std::expected<Datasets, Refusal> datasets_named(const App& app, const http::Request& request,
                                                std::string_view names) {
  if (names.empty()) return all_finest_first(app, request);
  Datasets datasets;
  while (!names.empty()) {
    const std::string_view name = names.substr(0, names.find(','));
    auto found = request.sees(name) ? app.catalog.find(name) : nullptr;
    if (!found || !found->source)
      return std::unexpected(
          fmt::format("there is no {}; /datasets lists all",
                      found ? "DEM behind a dataset of that name" : "dataset of that name"));
    if (std::ranges::find(datasets, found) == datasets.end()) datasets.push_back(std::move(found));
    names.remove_prefix(std::min(name.size() + 1, names.size()));
  }
  if (datasets.empty()) return std::unexpected("names no dataset; /datasets lists all");
  return datasets;
}

std::expected<std::vector<LookedUp>, http::Reply> look_up(const App& app, const Datasets& datasets,
                                                          std::span<const Geographic> where,
                                                          Interpolation interpolation,
                                                          std::string_view target,
                                                          const std::stop_token& stop) {
  std::vector<LookedUp> found(where.size());
  for (LookedUp& one : found) one.dataset = datasets.empty() ? nullptr : datasets[0].get();
  for (const auto& dataset : datasets) {
    std::vector<std::size_t> open;
    std::vector<Geographic> places;
    for (std::size_t i = 0; i < where.size(); ++i)
      if (!found[i].height_m && may_hold(*dataset, where[i])) {
        open.push_back(i);
        places.push_back(where[i]);
      }
    if (open.empty()) continue;
    const auto heights = heights_of(app, *dataset, places, {interpolation, {}, {}}, target, stop);
    if (!heights) return std::unexpected(heights.error());
    for (std::size_t n = 0; n < open.size(); ++n) {
      const HeightAt& height = heights->places[n].height;
      if (height.coverage == Coverage::value) found[open[n]] = {height.height_m, dataset.get()};
    }
  }
  return found;
}

std::expected<std::vector<Geographic>, Refusal> places_of_text(std::string_view text) {
  constexpr std::string_view kEncoded = "enc:";
  if (text.starts_with(kEncoded)) return places_of_polyline(text.substr(kEncoded.size()), 5);
  if (!text.empty() && text.find(',') == text.npos) {
    auto places = places_of_polyline(text, 5);
    if (places) return places;
    return std::unexpected("locations must be latitude,longitude|latitude,longitude; as " +
                           places.error());
  }
  std::vector<Geographic> places;
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find('|'));
    const auto place = place_of_text(one);
    if (!place)
      return std::unexpected(fmt::format("place {} is not latitude,longitude", places.size() + 1));
    if (auto wrong = not_on_earth(*place))
      return std::unexpected(fmt::format("place {} {}", places.size() + 1, *wrong));
    if (places.size() == kMostPlaces) return std::unexpected(too_many());
    places.push_back(*place);
    text.remove_prefix(std::min(one.size() + 1, text.size()));
  }
  if (places.empty()) return std::unexpected("no locations: latitude,longitude|latitude,longitude");
  return places;
}

std::expected<nlohmann::json, Refusal> read_json(std::string_view text) {
  constexpr std::size_t kMost = 5 * kMostPlaces;  // a place: an object with two numbers, and more
  if (json::count_values(text) > kMost)
    return std::unexpected(fmt::format("{} and {} JSON values", too_many(), kMost));
  auto json = json::parse<nlohmann::json>(text);
  if (json.is_discarded())
    return std::unexpected("no JSON, or nested too deeply, or with a number beyond doubles");
  return json;
}

std::expected<std::vector<Geographic>, Refusal> places_of_list(const nlohmann::json& json,
                                                               const std::string& list,
                                                               const char* lat, const char* lon) {
  if (!json.is_array() || json.empty())
    return std::unexpected(
        fmt::format("{} must be a list of {{\"{}\": ..., \"{}\": ...}}", list, lat, lon));
  if (json.size() > kMostPlaces) return std::unexpected(too_many());
  std::vector<Geographic> places;
  for (const nlohmann::json& one : json) {
    const std::string name = fmt::format("{}[{}] ", list, places.size());
    if (!one.is_object() || !one.contains(lat) || !one[lat].is_number() || !one.contains(lon) ||
        !one[lon].is_number())
      return std::unexpected(fmt::format("{}must have {} and {}, both numbers", name, lat, lon));
    places.push_back({one[lon].get<double>(), one[lat].get<double>()});
    if (auto wrong = not_on_earth(places.back())) return std::unexpected(name + *wrong);
  }
  return places;
}

std::expected<std::vector<Geographic>, Refusal> places_of_polyline(std::string_view text,
                                                                   int digits) {
  const auto decoded = proto::decode_polyline(text, digits, kMostPlaces);
  if (!decoded) return std::unexpected("the polyline " + decoded.error().what);
  if (decoded->empty()) return std::unexpected("the polyline is empty");
  std::vector<Geographic> places;
  for (const proto::PolylinePlace& p : *decoded) {
    places.push_back({p.lon, p.lat});
    if (auto wrong = not_on_earth(places.back()))
      return std::unexpected(fmt::format("place {} of the polyline {}", places.size(), *wrong));
  }
  return places;
}

std::optional<Refusal> not_on_earth(const Geographic& p) {
  if (!(std::abs(p.lat) <= 90)) return "has a latitude beyond -90 to 90";
  if (!(std::abs(p.lon) <= 360)) return "has a longitude beyond -360 to 360";
  return {};
}

services::Work work_of(const services::ServedDataset& dataset, std::size_t places) {
  constexpr std::int64_t kBlockPosts = 1 << 16;
  const bool quick = places <= kFewPlaces ||
                     dataset.source->post_count() <= std::int64_t(kFewPlaces) * kBlockPosts;
  return quick ? services::Work::question : services::Work::batch;
}

services::Work work_of(std::string_view question) {
  constexpr std::size_t kOtherMarks = 8;  // brackets, and what else is asked
  if (question.size() > kQuickly) return services::Work::batch;
  // Bad escapes are for whoever reads it to refuse.
  const std::string text = http::percent_decode(question).value_or(std::string(question));
  const bool quick = marks_of(text) <= 2 * kFewPlaces + kOtherMarks &&
                     text.find("sample") == text.npos && text.find("\\u") == text.npos;
  return quick ? services::Work::question : services::Work::batch;
}

}  // namespace tind::api
