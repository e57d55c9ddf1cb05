// Patches are glued by the places of their vertices, which are the same bits on a shared border.
// The centre lies on the vertices' lattice, so that what is left of them fits a float exactly.

#include "terrain/flightgear/bucket.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <map>
#include <string_view>

#include "proto/tile/terrasync.h"
#include "terrain/base/deflate.h"
#include "terrain/base/sha1.h"
#include "terrain/flightgear/patch.h"
#include "terrain/geo/ellipsoid.h"
#include "terrain/surface/post_warp.h"
#include "terrain/tile/tile_model.h"

namespace tind::flightgear {
namespace {

constexpr int kPacking = 9;  // libdeflate's level

class BucketMaker {
 public:
  BucketMaker(const BucketPlan& plan, BucketId id, const LandCover* cover, Bucket& said)
      : plan_(plan), cover_(cover), rect_(rect(id)), said_(said) {
    // Whole numbers over the bucket, even ones, so that textures of 1 and 2 km go on beyond it.
    const Vec2 degree = wgs84::metres_per_degree((rect_.south + rect_.north) / 2);
    const auto units = [](double metres) { return std::max(2.0, 2 * std::round(metres / 2000)); };
    texture_ = {units(rect_.width() * degree.x), units(rect_.height() * degree.y)};
  }

  Result<std::optional<proto::Btg>> make(const std::vector<GeoRect>& rects, std::stop_token stop);

 private:
  using Place = std::array<std::int64_t, 3>;  // ECEF, in steps of the lattice

  const BucketPlan& plan_;
  const LandCover* const cover_;
  const GeoRect rect_;
  Bucket& said_;
  Vec2 texture_;
  std::map<Place, std::uint32_t> index_;
  std::vector<Vec3> vertices_;
  proto::Btg btg_;
  std::map<std::string, std::vector<std::array<proto::Btg::Corner, 3>>> parts_;  // by material

  std::uint32_t vertex(const Patch&, std::size_t i);
  void add(const Patch&);
  Result<void> settle_center();
};

std::uint32_t BucketMaker::vertex(const Patch& patch, std::size_t i) {
  const Vec3& at = patch.ecef[i];
  const auto steps = [](double x) { return std::int64_t(std::llround(x / kLatticeStep)); };
  const auto [found, is_new] =
      index_.try_emplace({steps(at.x), steps(at.y), steps(at.z)}, std::uint32_t(vertices_.size()));
  if (!is_new) return found->second;
  vertices_.push_back(at);
  const auto byte = [](double x) {
    return std::uint8_t(std::clamp(std::floor((x + 1) * 127.5), 0.0, 255.0));
  };
  const Vec3& n = patch.normals[i];
  btg_.normals.push_back({byte(n.x), byte(n.y), byte(n.z)});
  const Geographic p = place_of(patch.rect, patch.mesh.vertices[i]);
  btg_.texcoords.push_back({float((p.lon - rect_.west) / rect_.width() * texture_.x),
                            float((p.lat - rect_.south) / rect_.height() * texture_.y)});
  return found->second;
}

void BucketMaker::add(const Patch& patch) {
  for (std::size_t i = 0; i < patch.mesh.triangles.size(); ++i) {
    const Triangle& t = patch.mesh.triangles[i];
    const std::array<std::uint32_t, 3> v = {vertex(patch, t[0]), vertex(patch, t[1]),
                                            vertex(patch, t[2])};
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;  // at a pole
    const auto corner = [](std::uint32_t k) { return proto::Btg::Corner{k, k, k}; };
    parts_[patch.materials[i]].push_back({corner(v[0]), corner(v[1]), corner(v[2])});
  }
  said_.max_error_m = std::max(said_.max_error_m, patch.max_error_m);
  said_.edge_error_m = std::max(said_.edge_error_m, patch.edge_error_m);
  said_.posts += patch.posts;
  said_.void_share += patch.void_share;
}

/// In the middle, in whole metres.
Result<void> BucketMaker::settle_center() {
  Vec3 low = vertices_[0], high = low;
  for (const Vec3& v : vertices_) {
    low = {std::min(low.x, v.x), std::min(low.y, v.y), std::min(low.z, v.z)};
    high = {std::max(high.x, v.x), std::max(high.y, v.y), std::max(high.z, v.z)};
  }
  const Vec3 middle = (low + high) * 0.5;
  const Vec3 center{std::nearbyint(middle.x), std::nearbyint(middle.y), std::nearbyint(middle.z)};
  btg_.center = {center.x, center.y, center.z};
  double farthest = 0;
  for (const Vec3& v : vertices_) {
    const Vec3 d = v - center;
    if (std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)}) >= kFarthest_m)
      return fail(Errc::unsupported,
                  "a bucket whose heights differ by more than 20 km; look for values that mean no "
                  "data (--nodata)");
    farthest = std::max(farthest, length(d));
    btg_.vertices.push_back({float(d.x), float(d.y), float(d.z)});
  }
  btg_.radius = std::nextafter(float(farthest), 1e9f);
  return {};
}

Result<std::optional<proto::Btg>> BucketMaker::make(const std::vector<GeoRect>& rects,
                                                    std::stop_token stop) {
  for (const GeoRect& one : rects) {
    const auto patch = make_patch(plan_, one, stop, cover_);
    if (!patch) return std::unexpected(patch.error());
    add(*patch);
  }
  if (said_.posts == 0) return std::nullopt;
  said_.void_share /= double(rects.size());
  if (auto done = settle_center(); !done) return std::unexpected(done.error());
  for (auto& [material, triangles] : parts_) {
    said_.triangles += triangles.size();
    btg_.parts.push_back({material, std::move(triangles)});
  }
  return std::move(btg_);
}

std::string number(BucketId id) { return std::to_string(index_of(id)); }

constexpr const char* kSaysError = "largest vertical error: ";
constexpr const char* kSaysVoid = "ground without a known height: ";
constexpr const char* kSaysSha1 = "sha1 of the ground: ";

}  // namespace

std::string btg_name(BucketId id) { return number(id) + ".btg.gz"; }
std::string stg_name(BucketId id) { return number(id) + ".stg"; }

Result<std::optional<proto::Btg>> model_bucket(const BucketPlan& plan, BucketId id, Bucket& said,
                                               std::stop_token stop, const LandCover* cover) {
  auto made = BucketMaker(plan, id, cover, said).make(patch_rects(plan, id), std::move(stop));
  if (!made) return fail("bucket " + number(id), made.error());
  return made;
}

Result<std::optional<Bucket>> make_bucket(const BucketPlan& plan, BucketId id, std::stop_token stop,
                                          const LandCover* cover) {
  Bucket bucket;
  const auto btg = model_bucket(plan, id, bucket, std::move(stop), cover);
  if (!btg) return std::unexpected(btg.error());
  if (!*btg) return std::nullopt;
  bucket.max_error_m = std::ceil(bucket.max_error_m * 1e4) / 1e4;
  bucket.edge_error_m = std::ceil(bucket.edge_error_m * 1e4) / 1e4;
  bucket.btg_gz = deflate(encode(**btg), Wrapping::gzip, kPacking);
  const std::string remarks[] = {
      fmt::format("{}{:.4f} m, over {} posts", kSaysError, bucket.max_error_m, bucket.posts),
      fmt::format("{}{:.1f} %, filled from beside it or 0 m above the sea", kSaysVoid,
                  bucket.void_share * 100),
      kSaysSha1 + sha1(bucket.btg_gz)};
  bucket.stg = proto::encode_stg(number(id) + ".btg", remarks);
  return bucket;
}

std::optional<SaidInStg> read_stg(const std::string& stg) {
  constexpr std::size_t kDigits = 40;
  SaidInStg said;
  const std::size_t error = stg.find(kSaysError), sum = stg.find(kSaysSha1),
                    voids = stg.find(kSaysVoid);
  if (error == std::string::npos || sum == std::string::npos || voids == std::string::npos ||
      !stg.ends_with('\n'))
    return {};
  if (std::sscanf(stg.c_str() + voids + std::string_view(kSaysVoid).size(), "%lf %%",
                  &said.void_share) != 1)
    return {};
  said.void_share /= 100;
  if (std::sscanf(stg.c_str() + error + std::string_view(kSaysError).size(),
                  "%lf m, over %" SCNu64 " posts", &said.max_error_m, &said.posts) != 2)
    return {};
  said.sha1 = stg.substr(sum + std::string_view(kSaysSha1).size(), kDigits);
  if (said.sha1.size() != kDigits || stg.find("\nOBJECT_BASE ") == std::string::npos) return {};
  return said;
}

bool is_anothers_stg(const std::string& stg) {
  return stg.find("OBJECT") != std::string::npos && stg.find(kSaysSha1) == std::string::npos;
}

}  // namespace tind::flightgear
