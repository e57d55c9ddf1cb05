#include "terrain/pyramid/decoded_tile.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "proto/quantized_mesh.h"
#include "terrain/tile/post_warp.h"

namespace tind {
namespace {

std::optional<DecodedTile::Statement> statement(const std::string& metadata) {
  const auto json = nlohmann::json::parse(metadata, nullptr, false);
  if (!json.is_object()) return {};
  const auto number = [&](const char* name) -> std::optional<double> {
    const auto found = json.find(name);
    if (found == json.end() || !found->is_number()) return {};
    return std::max(0.0, found->get<double>());
  };
  const auto text = [&](const char* name, const std::string& otherwise) {
    const auto found = json.find(name);
    return found != json.end() && found->is_string() ? found->get<std::string>() : otherwise;
  };
  const auto error = number("max_error_m");
  if (!error) return {};
  return DecodedTile::Statement{.max_error_m = *error,
                                .edge_error_m = number("edge_error_m").value_or(0),
                                .exact = text("error_kind", "") == "exact",
                                .side = text("side", "both")};
}

}  // namespace

Result<DecodedTile> decode_tile(std::span<const std::uint8_t> bytes) {
  std::string reason;
  auto q = proto::decode(bytes, reason);
  if (!q) return fail(Errc::bad_data, reason);
  DecodedTile tile;
  const double low = q->min_height;
  tile.range_m = double(q->max_height) - low;
  for (std::size_t i = 0; i < q->u.size(); ++i)
    tile.mesh.vertices.push_back(
        {double(q->u[i]), double(q->v[i]), low + q->h[i] * tile.range_m / kTileExtent});
  tile.mesh.triangles = std::move(q->triangles);
  tile.says = statement(q->metadata);
  return tile;
}

}  // namespace tind
