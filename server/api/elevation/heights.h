#pragma once
// What resources that answer with heights have in common: how a client says which heights it wants,
// and how they are found.

#include <cstddef>
#include <expected>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/api/app.h"
#include "server/api/elevation/level_bands.h"
#include "server/http/message/query_numbers.h"
#include "terrain/analysis/heights_at.h"
#include "terrain/tile/level_heights.h"

namespace tind::api {

/// Which of the heights of a place.
struct HeightQuestion {
  Interpolation interpolation = Interpolation::bilinear;
  std::optional<int> level;  // of the mesh that a client of this level draws; none: of the DEM
  std::string datum;         // a word of the query; empty: as the dataset has it
};

/// The parameters datum, interpolation and surface of a query, for http::read_numbers().
std::span<const http::QueryWord> height_words();
/// Of what they said, in the order of height_words().
HeightQuestion height_question(std::span<const std::string> words);

struct PlaceHeight {
  HeightAt height;
  std::size_t layer = 0;              // of the surface; REQUIRES: of the DEM, a height
  std::optional<TileId> tile;         // whose mesh it is
  std::optional<double> max_error_m;  // no post of that tile is farther from its mesh
  std::optional<Band> band = {};      // of a mesh: where the DEM is, also between posts
};

struct Heights {
  std::string datum;
  std::vector<PlaceHeight> places;
};

/// The answer of a request that cannot have heights like these: a 404 where the dataset has no
/// tiles or no DEM. Cheap: for I/O threads.
std::optional<http::Reply> no_such_heights(const services::ServedDataset&, const HeightQuestion&,
                                           const http::Request&);

/// On a worker. The error is the reply that says what is wrong. `target`: of the request.
std::expected<Heights, http::Reply> heights_of(const App&, const services::ServedDataset&,
                                               std::span<const Geographic>, const HeightQuestion&,
                                               std::string_view target, const std::stop_token&);

/// The datum that such a word names, for heights of this DEM; empty: as the dataset has it. The
/// error says what is wrong with `datum`.
Result<VerticalDatum> datum_asked(const std::string& word, const DemInfo&);
/// Heights of the DEM as they are above another datum, in place; NaN stays. invalid_argument where
/// that is not known there.
Result<void> bring_to_datum(const Environment&, std::span<const Geographic>, std::span<double>,
                            const DemInfo&, const VerticalDatum&);

/// Of a mesh's height: between which heights the DEM's is, in millimetres, rounded outwards.
std::optional<std::pair<double, double>> height_between(const PlaceHeight&);

/// "value", "void", "outside".
const char* word(Coverage);

/// A height as answers have it: null where there is none.
nlohmann::ordered_json height_json(const HeightAt&);

}  // namespace tind::api
