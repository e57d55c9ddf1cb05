// Any bytes as the bodies of POST /plan and /tiles, as tiles in frames and as a transition:
// refused with a reason, or within the stated limits; and a transition that is accepted gives a
// mesh at any parameter.

#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "proto/stream/tile_frames.h"
#include "server/api/flights/flight_request.h"
#include "terrain/pyramid/make/tile_transition.h"

namespace {

void require(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tind;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  api::Problems problems;
  const api::FlightRequest flight = api::parse_flight_request(text, problems);
  if (problems.empty()) {
    require(!flight.flight.empty() && flight.flight.size() <= api::kMostFixes);
    for (const FlightFix& f : flight.flight) require(std::isfinite(f.where.lon + f.time_s));
  }
  for (const auto& problem : problems.list())
    require(!problem.parameter.empty() && !problem.detail.empty());
  api::Problems in_list;
  const auto tiles = api::parse_tile_list(text, in_list);
  require(!in_list.empty() || (!tiles.empty() && tiles.size() <= api::kMostTiles));
  if (const auto frames = proto::decode_frames({data, size}))
    for (const proto::TileFrame& f : *frames) require(f.bytes.size() <= size);
  if (const auto t = proto::decode_transition({data, size})) {
    require(proto::encode(*t).size() == size);
    const TerrainTransition way = from_wire(*t);
    for (const double s : {0.0, 0.5, 1.0})
      for (const Triangle& q : mesh_at(way, s).triangles)
        for (const std::uint32_t v : q) require(v < t->u.size());
  }
  return 0;
}
