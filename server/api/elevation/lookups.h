#pragma once
// What the addresses that other elevation services have made common share: places as their clients
// write them, and heights from whichever dataset has them.

#include <cstddef>
#include <expected>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "server/api/app.h"
#include "terrain/analysis/heights_at.h"
#include "terrain/geo/coordinates.h"

namespace tind::api {

/// Why a client's request cannot be answered, in a line: its service has a form of its own for it.
using Refusal = std::string;

using Datasets = std::vector<std::shared_ptr<const services::ServedDataset>>;

/// All that have a DEM and that who asks may see, the finest first.
Datasets all_finest_first(const App&, const http::Request&);
/// "alps,world", in this order; empty: all_finest_first().
std::expected<Datasets, Refusal> datasets_named(const App&, const http::Request&,
                                                std::string_view names);

struct LookedUp {
  std::optional<double> height_m;  // above what the dataset's heights are above; never 0 for none
  const services::ServedDataset* dataset = nullptr;  // whose it is; else the first that was asked
};

/// Of each place the height in the first dataset that has one there. On a worker. The error is the
/// reply that says what is wrong.
std::expected<std::vector<LookedUp>, http::Reply> look_up(const App&, const Datasets&,
                                                          std::span<const Geographic>,
                                                          Interpolation, std::string_view target,
                                                          const std::stop_token&);

/// "46.85,-121.76|46.9,-121.8", or an encoded polyline of five digits (after "enc:", or where there
/// is no comma); latitude first.
std::expected<std::vector<Geographic>, Refusal> places_of_text(std::string_view);

/// The parameter that places_of_text() reads, for documents.
http::QueryWord locations_word();

/// JSON that a client sent; refused before it is built where it has more values than places could
/// need: a tree of 8 MiB of brackets takes two dozen times as much.
std::expected<nlohmann::json, Refusal> read_json(std::string_view);

/// [{"lat": 46.85, "lon": -121.76}, ...]. `list`: what it is called; `lat`, `lon`: what these are.
std::expected<std::vector<Geographic>, Refusal> places_of_list(const nlohmann::json&,
                                                               const std::string& list,
                                                               const char* lat, const char* lon);

/// A polyline as places of the earth.
std::expected<std::vector<Geographic>, Refusal> places_of_polyline(std::string_view, int digits);

/// Nothing, or what is wrong with a place.
std::optional<Refusal> not_on_earth(const Geographic&);

/// Each place of a question may have a block of posts decoded for it: of so many that is soon done,
/// wherever they are.
inline constexpr std::size_t kFewPlaces = 16;

/// The class of work of at most so many places of a dataset. REQUIRES: a DEM.
services::Work work_of(const services::ServedDataset&, std::size_t places);

/// The same of a question by its text: reading a long one is work, too, and one for places along a
/// way may make many of a few. So it is read on the worker.
services::Work work_of(std::string_view question);

}  // namespace tind::api
