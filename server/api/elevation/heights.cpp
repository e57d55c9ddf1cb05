#include "server/api/elevation/heights.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "server/http/message/problem.h"
#include "server/services/tiles/finished_model.h"
#include "terrain/raster/crs_points.h"
#include "terrain/raster/datums.h"

namespace tind::api {
namespace {

/// "level=12": what a client of that level draws.
std::optional<int> level_of(std::string_view text) {
  constexpr std::string_view kLevel = "level=";
  if (!text.starts_with(kLevel)) return {};
  text.remove_prefix(kLevel.size());
  int level = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), level);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  if (!whole || level < 0 || level > tiling::kMaxLevel) return {};
  return level;
}

/// What an answer may say of the datum: neither where grids are looked for nor which are there.
std::unexpected<Error> not_above(const std::string& word, const char* why) {
  return fail(Errc::invalid_argument, "cannot be " + word + ": " + why);
}

/// The datum of a word of the query, for heights that are above `own`.
Result<VerticalDatum> datum_of(const std::string& word, const VerticalDatum& own,
                               const VerticalDatum& source) {
  if (word.empty() || word == "source") return source;
  auto datum = datum_named(word);
  if (!datum) return not_above(word, "PROJ knows no such vertical CRS that counts upwards");
  if (*datum != own && own == VerticalDatum::unknown)
    return not_above(word, "what this DEM's heights are above is not known");
  return datum;
}

/// Heights above one datum, somewhere.
struct Above {
  VerticalDatum datum;
  GeoRect area;
  std::string crs_wkt;
};

/// Heights as they are above another datum, in place.
Result<void> convert(const Environment& environment, std::span<const Geographic> where,
                     std::span<double> heights, const Above& from, const VerticalDatum& to) {
  if (from.datum == to) return {};
  double sign = 1;
  std::vector<double> above(where.size());
  for (const VerticalDatum& datum : {from.datum, to}) {
    const auto surface = datum_surface(datum, from.area, from.crs_wkt, environment);
    if (!surface && surface.error().code == Errc::io) return std::unexpected(surface.error());
    if (!surface) return not_above(name(to), "its grid is not here, or does not reach there");
    std::ranges::fill(above, 0);
    if (*surface) (*surface)->undulations(where, above);
    for (std::size_t i = 0; i < where.size(); ++i) {
      if (std::isnan(above[i])) return not_above(name(to), "its grid does not reach there");
      heights[i] += sign * above[i];
    }
    sign = -1;
  }
  for (double& h : heights) h = std::round(h * 1000) / 1000;  // it was rounded once already
  return {};
}

/// The same of those among the places that have a height and for which `which` holds.
Result<void> convert_those(const App& app, std::span<const Geographic> where,
                           std::span<PlaceHeight> places, const Above& from,
                           const VerticalDatum& to, auto&& which) {
  if (from.datum == to) return {};
  std::vector<std::size_t> those;
  std::vector<Geographic> at;
  std::vector<double> heights;
  for (std::size_t i = 0; i < places.size(); ++i)
    if (places[i].height.coverage == Coverage::value && which(places[i])) {
      those.push_back(i);
      at.push_back(where[i]);
      heights.push_back(places[i].height.height_m);
    }
  if (auto done = convert(app.environment, at, heights, from, to); !done) return done;
  for (std::size_t n = 0; n < those.size(); ++n) places[those[n]].height.height_m = heights[n];
  return {};
}

/// Where the posts are that `nearest` answers with: those heights are above what is there.
std::vector<Geographic> nearest_posts(const DemSource& source, std::span<const Geographic> where) {
  std::vector<Vec2> posts(where.size());
  source.to_post(where, posts);
  for (Vec2& post : posts) post = {std::floor(post.x + 0.5), std::floor(post.y + 0.5)};
  std::vector<Geographic> places(where.size());
  source.to_geographic(posts, places);
  return places;
}

Result<Heights> of_source(const App& app, const Surface& surface, std::span<const Geographic> where,
                          const HeightQuestion& question, const std::stop_token& stop) {
  auto found = heights_at(surface, where, question.interpolation, stop);
  if (!found) return std::unexpected(found.error());
  Heights out;
  for (const SurfaceHeight& h : *found) out.places.push_back({h.height, h.layer, {}, {}});
  const auto layers = surface.layers();
  // Layers from different datums are one surface only as they were converted; where it is not known
  // of all what they are above, as they are.
  const VerticalDatum own = surface.info().source_datum;
  const bool of_all = own != VerticalDatum::unknown;
  for (std::size_t k = 0; k < layers.size(); ++k) {
    const auto decides = [&](const PlaceHeight& p) { return p.layer == k; };
    const bool asked = std::ranges::any_of(out.places, decides);
    if (!asked && !(k == 0 && out.datum.empty())) continue;
    const DemInfo& info = layers[k].source->info();
    const auto datum = datum_of(question.datum, info.datum, of_all ? own : info.datum);
    if (!datum) return std::unexpected(datum.error());
    if (out.datum.empty() || out.datum == "unknown") out.datum = name(*datum);
    std::vector<Geographic> posts;
    if (question.interpolation == Interpolation::nearest && info.datum != *datum)
      posts = nearest_posts(*layers[k].source, where);
    if (auto done = convert_those(app, posts.empty() ? where : posts, out.places,
                                  {info.datum, info.bounds, info.crs_wkt}, *datum, decides);
        !done)
      return std::unexpected(done.error());
  }
  return out;
}

Result<Heights> of_level(const App& app, const services::ServedDataset& dataset,
                         std::span<const Geographic> where, const HeightQuestion& question,
                         const std::stop_token& stop) {
  const LevelTiles tiles = services::level_tiles(app.tiles, dataset);
  const auto bands = LevelBands::of(dataset, where, stop);
  if (!bands) return std::unexpected(bands.error());
  std::vector<Geographic> all_places(where.begin(), where.end());
  all_places.insert(all_places.end(), bands->posts().begin(), bands->posts().end());
  const auto found = level_heights(tiles, all_places, *question.level, stop);
  if (!found) return std::unexpected(found.error());
  const std::span seen = std::span(*found).first(where.size()),
                  at_posts = std::span(*found).subspan(where.size());
  const DatasetFacts facts = dataset.facts();
  const auto own =
      facts.datum.empty() ? VerticalDatum() : datum_named(facts.datum).value_or(VerticalDatum());
  const auto datum = datum_of(question.datum, own, own);
  if (!datum) return std::unexpected(datum.error());
  Heights out{name(*datum), {}};
  for (std::size_t i = 0; i < seen.size(); ++i)
    out.places.push_back(seen[i] ? PlaceHeight{{Coverage::value, seen[i]->height_m},
                                               0,
                                               seen[i]->tile,
                                               seen[i]->max_error_m,
                                               bands->band(i, seen[i], at_posts)}
                                 : PlaceHeight{});
  const auto all = [](const PlaceHeight&) { return true; };
  if (auto done = convert_those(app, where, out.places, {own, facts.bounds, {}}, *datum, all);
      !done)
    return std::unexpected(done.error());
  return out;
}

bool is_level(std::string_view text) { return level_of(text).has_value(); }

}  // namespace

std::span<const http::QueryWord> height_words() {
  static const std::array<http::QueryWord, 3> kWords = {{
      {"datum",
       {"source", "ellipsoid", "egm84", "egm96", "egm2008"},
       is_epsg_code,
       "EPSG:CODE of a vertical CRS",
       "what heights are to be above; source: as the dataset has it",
       "^EPSG:[1-9][0-9]{3,4}$",
       "ellipsoid"},
      {"interpolation", {"bilinear", "nearest", "cubic"}, nullptr, {}, "between posts"},
      {"surface",
       {"source"},
       is_level,
       "level=Z, the mesh that a client of level Z draws",
       "the DEM, or what a client of a level of tiles sees",
       "^level=([0-9]|1[0-9]|2[0-4])$",
       "level=10"},
  }};
  return kWords;
}

HeightQuestion height_question(std::span<const std::string> words) {
  HeightQuestion question;
  question.datum = words[0];
  if (!words[1].empty()) question.interpolation = *enum_named<Interpolation>(words[1]);
  question.level = level_of(words[2]);
  return question;
}

std::optional<http::Reply> no_such_heights(const services::ServedDataset& dataset,
                                           const HeightQuestion& question,
                                           const http::Request& request) {
  if (question.level && !dataset.tiles) return no_tiles(request);
  if (!question.level && !dataset.source) return no_source(request);
  if (question.level && question.interpolation != Interpolation::bilinear)
    return http::problem_reply(
        {{"interpolation", "is for a DEM: the surface of a level is a mesh, which has its own"}},
        request.head.target);
  return std::nullopt;
}

std::expected<Heights, http::Reply> heights_of(
    const App& app, const services::ServedDataset& dataset, std::span<const Geographic> where,
    const HeightQuestion& question, std::string_view target, const std::stop_token& stop) {
  auto found = question.level ? of_level(app, dataset, where, question, stop)
                              : of_source(app, *dataset.source, where, question, stop);
  if (found) return std::move(*found);
  if (found.error().code == Errc::invalid_argument)  // a served DEM has a CRS: it is the datum
    return std::unexpected(http::problem_reply({{"datum", found.error().what}}, target));
  return std::unexpected(http::problem_reply(found.error(), target));
}

Result<VerticalDatum> datum_asked(const std::string& word, const DemInfo& info) {
  return datum_of(word, info.datum, info.source_datum);
}

Result<void> bring_to_datum(const Environment& environment, std::span<const Geographic> where,
                            std::span<double> heights, const DemInfo& info,
                            const VerticalDatum& to) {
  if (info.datum == to) return {};
  std::vector<std::size_t> those;
  std::vector<Geographic> at;
  std::vector<double> values;
  for (std::size_t i = 0; i < heights.size(); ++i)
    if (!std::isnan(heights[i])) {
      those.push_back(i);
      at.push_back(where[i]);
      values.push_back(heights[i]);
    }
  const Above from{info.datum, info.bounds, info.crs_wkt};
  if (auto done = convert(environment, at, values, from, to); !done) return done;
  for (std::size_t n = 0; n < those.size(); ++n) heights[those[n]] = values[n];
  return {};
}

std::optional<std::pair<double, double>> height_between(const PlaceHeight& place) {
  if (!place.band) return std::nullopt;  // a millimetre more: another datum's are rounded
  return std::pair(std::floor((place.height.height_m + place.band->low_m) * 1000 - 1) / 1000,
                   std::ceil((place.height.height_m + place.band->high_m) * 1000 + 1) / 1000);
}

const char* word(Coverage coverage) {
  switch (coverage) {
    case Coverage::value:
      return "value";
    case Coverage::void_:
      return "void";
    case Coverage::outside:
      return "outside";
  }
  return "outside";
}

nlohmann::ordered_json height_json(const HeightAt& height) {
  if (height.coverage == Coverage::value) return height.height_m;
  return nullptr;
}

}  // namespace tind::api
