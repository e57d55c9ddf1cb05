#include "terrain/encode/quantized_mesh_tile.h"

#include <algorithm>
#include <cassert>

#include "proto/json_member.h"
#include "proto/json_text.h"
#include "proto/tile/quantized_mesh.h"

namespace tind {
namespace {

nlohmann::ordered_json availability(const std::vector<std::vector<proto::TileRange>>& levels) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const auto& ranges : levels) {
    json.push_back(nlohmann::ordered_json::array());
    for (const proto::TileRange& r : ranges)
      json.back().push_back(
          {{"startX", r.start_x}, {"startY", r.start_y}, {"endX", r.end_x}, {"endY", r.end_y}});
  }
  return json;
}

std::string metadata_of(const TileModel& tile) {
  const TileCertificate& says = *tile.certificate;
  nlohmann::ordered_json metadata;
  metadata["geometricerror"] = tile.displayed_error_m;
  metadata["max_error_m"] = says.max_error_m;
  metadata["error_kind"] = says.exact ? "exact" : "bound";
  metadata["edge_error_m"] = says.edge_error_m;
  if (tile.one_sided) metadata["side"] = name_of(says.side);
  metadata["posts"] = tile.posts;
  if (tile.residual_m) metadata["residual_m"] = *tile.residual_m;
  if (!tile.descendants.empty()) metadata["available"] = availability(tile.descendants);
  return metadata.dump();
}

/// Members of tind's metadata; what is of another kind reads as not there.
std::optional<double> distance(const nlohmann::json& metadata, const char* name) {
  const auto x = json::number(metadata, name);
  return x ? std::optional(std::max(0.0, *x)) : std::nullopt;
}

void read_metadata(const std::string& text, TileModel& tile) {
  const auto metadata = json::parse<nlohmann::json>(text);
  const auto error = distance(metadata, "max_error_m");
  if (!error) return;
  const auto side = enum_named<Side>(json::text(metadata, "side").value_or(""));
  tile.certificate = TileCertificate{.max_error_m = *error,
                                     .edge_error_m = distance(metadata, "edge_error_m").value_or(0),
                                     .exact = json::text(metadata, "error_kind") == "exact",
                                     .side = side.value_or(Side::both)};
  tile.one_sided = side.has_value();
  tile.displayed_error_m = distance(metadata, "geometricerror").value_or(0);
  tile.posts = std::uint64_t(std::min(distance(metadata, "posts").value_or(0), 0x1p53));
  tile.residual_m = distance(metadata, "residual_m");
}

}  // namespace

std::vector<std::uint8_t> encode_quantized_mesh(const TileModel& tile) {
  assert(tile.certificate && tile.normals.size() == tile.mesh.vertices.size());
  proto::QuantizedMesh q;
  for (const Vec3& v : tile.mesh.vertices) {
    q.u.push_back(std::uint16_t(v.x));
    q.v.push_back(std::uint16_t(v.y));
    q.h.push_back(tile.heights.index(v.z));
  }
  q.triangles = tile.mesh.triangles;
  q.oct_normals = tile.normals;
  q.water_mask = tile.water_mask;
  q.min_height = float(tile.heights.min);
  q.max_height = float(tile.heights.max());
  // Else clients would decode other heights than were measured (finest_step(), height_steps.h).
  assert(q.min_height == tile.heights.min && q.max_height == tile.heights.max());
  const CullingVolumes& volumes = tile.volumes;
  q.center = {volumes.center.x, volumes.center.y, volumes.center.z};
  q.bounding_sphere = {volumes.sphere_center.x, volumes.sphere_center.y, volumes.sphere_center.z,
                       volumes.sphere_radius};
  q.horizon_occlusion = {volumes.horizon_occlusion.x, volumes.horizon_occlusion.y,
                         volumes.horizon_occlusion.z};
  q.metadata = metadata_of(tile);
  proto::arrange(q);
  return proto::encode(q);
}

Result<TileModel> decode_tile(TileId id, std::span<const std::uint8_t> bytes) {
  auto q = proto::decode(bytes);
  if (!q) return std::unexpected(q.error());
  if (q->triangles.empty()) return fail(Errc::bad_data, "a tile without a triangle");
  TileModel tile;
  tile.id = id;
  const double low = q->min_height, range = double(q->max_height) - low;
  tile.heights = {low, range / kTileExtent};
  tile.mesh.vertices.reserve(q->u.size());
  for (std::size_t i = 0; i < q->u.size(); ++i)
    tile.mesh.vertices.push_back(
        {double(q->u[i]), double(q->v[i]), low + q->h[i] * range / kTileExtent});
  tile.mesh.triangles = std::move(q->triangles);
  tile.normals = std::move(q->oct_normals);
  tile.water_mask = std::move(q->water_mask);
  const auto& [x, y, z] = q->center;
  const auto& sphere = q->bounding_sphere;
  const auto& hidden = q->horizon_occlusion;
  tile.volumes = {
      {x, y, z}, {sphere[0], sphere[1], sphere[2]}, sphere[3], {hidden[0], hidden[1], hidden[2]}};
  read_metadata(q->metadata, tile);
  return tile;
}

}  // namespace tind
