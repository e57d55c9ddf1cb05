#include "server/api/flight_request.h"

#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>

#include "server/api/tile_address.h"

namespace tind::api {
namespace {

using Json = nlohmann::json;

std::unexpected<Error> wrong(const std::string& what) { return fail(Errc::invalid_argument, what); }

/// An object with only these keys.
Result<void> only(const Json& json, const std::string& where,
                  std::initializer_list<std::string_view> keys) {
  if (!json.is_object()) return wrong(where + " must be an object");
  for (const auto& [key, value] : json.items())
    if (std::ranges::find(keys, key) == keys.end())
      return wrong("\"" + key + "\" is not known in " + where);
  return {};
}

Result<void> number(const Json& json, const char* key, const std::string& where, double& value,
                    bool required) {
  const auto found = json.find(key);
  if (found == json.end()) {
    if (required) return wrong(where + " has no \"" + key + "\"");
    return {};
  }
  if (!found->is_number()) return wrong("\"" + std::string(key) + "\" must be a number");
  value = found->get<double>();
  if (!std::isfinite(value)) return wrong("\"" + std::string(key) + "\" is too large");
  return {};
}

struct Field {
  const char* key;
  double* value;
};

Result<void> numbers(const Json& json, const std::string& where, bool required,
                     std::initializer_list<Field> fields) {
  for (const Field& f : fields)
    if (auto ok = number(json, f.key, where, *f.value, required); !ok) return ok;
  return {};
}

Result<void> read_trajectory(const Json& list, FlightRequest& out) {
  if (!list.is_array() || list.empty() || list.size() > kMostFixes)
    return wrong("\"trajectory\" must be a list of 1 to " + std::to_string(kMostFixes) + " fixes");
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string where = "fix " + std::to_string(i);
    FlightFix f;
    if (auto ok = only(list[i], where, {"lon", "lat", "height_m", "time_s"}); !ok) return ok;
    if (auto ok = numbers(list[i], where, true,
                          {{"lon", &f.where.lon},
                           {"lat", &f.where.lat},
                           {"height_m", &f.height_m},
                           {"time_s", &f.time_s}});
        !ok)
      return ok;
    out.flight.push_back(f);
  }
  return {};
}

Result<void> read_straight(const Json& json, FlightRequest& out) {
  FlightFix from;
  double east = 0, north = 0, up = 0, horizon = 0;
  const Json none = Json::object();
  const Json& position = json.contains("position") ? json["position"] : none;
  const Json& velocity = json.contains("velocity") ? json["velocity"] : none;
  if (auto ok = only(position, "position", {"lon", "lat", "height_m"}); !ok) return ok;
  if (auto ok = only(velocity, "velocity", {"east", "north", "up"}); !ok) return ok;
  if (auto ok = numbers(
          position, "position", true,
          {{"lon", &from.where.lon}, {"lat", &from.where.lat}, {"height_m", &from.height_m}});
      !ok)
    return ok;
  if (auto ok =
          numbers(velocity, "velocity", false, {{"east", &east}, {"north", &north}, {"up", &up}});
      !ok)
    return ok;
  if (auto ok = number(json, "horizon_s", "the request", horizon, true); !ok) return ok;
  const double speed = std::hypot(east, north, up);
  if (!(horizon >= 0 && horizon <= 86400) || !(speed <= 1e5) || !(std::abs(from.where.lat) <= 90))
    return wrong("a horizon of 0 to 86400 s, at most 100 km/s, from a latitude of -90 to 90");
  out.flight = straight_flight(from, east, north, up, horizon);
  return {};
}

}  // namespace

Result<FlightRequest> parse_flight_request(std::string_view body) {
  const Json json = Json::parse(body, nullptr, false);
  if (json.is_discarded()) return wrong("the body is not JSON");
  if (auto ok = only(json, "the request",
                     {"trajectory", "position", "velocity", "horizon_s", "link_bits_per_s",
                      "tolerance_px", "viewport_height_px", "fov_deg", "tile_bytes"});
      !ok)
    return std::unexpected(ok.error());
  FlightRequest out;
  FlightOptions& o = out.options;
  if (auto ok = numbers(json, "the request", false,
                        {{"link_bits_per_s", &o.link_bits_per_s},
                         {"tolerance_px", &o.tolerance_px},
                         {"viewport_height_px", &o.viewport_height_px},
                         {"fov_deg", &o.fov_deg},
                         {"tile_bytes", &out.tile_bytes}});
      !ok)
    return std::unexpected(ok.error());
  if (!(out.tile_bytes >= 1 && out.tile_bytes <= 1e9))
    return wrong("\"tile_bytes\" must be 1 to 1e9");
  const bool listed = json.contains("trajectory");
  if (listed &&
      (json.contains("position") || json.contains("velocity") || json.contains("horizon_s")))
    return wrong("either a trajectory, or position, velocity and horizon_s");
  auto ok = listed ? read_trajectory(json["trajectory"], out) : read_straight(json, out);
  if (!ok) return std::unexpected(ok.error());
  return out;
}

Result<std::vector<TileId>> parse_tile_list(std::string_view body) {
  const Json json = Json::parse(body, nullptr, false);
  if (json.is_discarded()) return wrong("the body is not JSON");
  if (auto ok = only(json, "the request", {"tiles"}); !ok) return std::unexpected(ok.error());
  const auto list = json.find("tiles");
  if (list == json.end() || !list->is_array() || list->empty() || list->size() > kMostTiles)
    return wrong("\"tiles\" must be a list of 1 to " + std::to_string(kMostTiles) + " addresses");
  std::vector<TileId> out;
  for (const Json& item : *list) {
    const std::string text = item.is_string() ? item.get<std::string>() : "";
    const auto first = text.find('/'), last = text.rfind('/');
    std::optional<TileId> id;
    if (first != text.npos && last != first)
      id = tile_address(std::string_view(text).substr(0, first),
                        std::string_view(text).substr(first + 1, last - first - 1),
                        std::string_view(text).substr(last + 1));
    if (!id)
      return wrong("tile " + std::to_string(out.size()) + " is not \"z/x/y\" of the pyramid");
    out.push_back(*id);
  }
  return out;
}

}  // namespace tind::api
