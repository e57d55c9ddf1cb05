#pragma once
// Meshes that follow a region or a camera, for POST /refine: the multi-triangulations of datasets,
// made when first asked for, and the views of clients. Everything here is bounded.

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <stop_token>
#include <string>

#include "proto/stream/refine_delta.h"
#include "server/services/datasets/catalog.h"
#include "server/services/refine/refine_window.h"
#include "terrain/base/lru.h"
#include "terrain/base/result.h"
#include "terrain/progressive/multires/camera.h"
#include "terrain/progressive/multires/geo_region.h"
#include "terrain/progressive/multires/refine_region.h"
#include "terrain/progressive/multires/view_front.h"
#include "terrain/raster/dem_source.h"

namespace tind::services {

struct RefineLimits {
  std::size_t posts = 1'000'000;  // of a dataset or window that can be refined; 200 bytes each
  std::size_t scenes = 2;  // of them kept ready, and made at a time: whoever has most of them loses
                           // one, the one not used for longest
  std::size_t views = 64;  // of all clients: whoever has most of them loses one, first those that
                           // were never asked for again, of them the one not used for longest
  std::size_t view_bytes = 256 << 20;
  std::chrono::seconds view_age{300};  // without being asked for
};

/// Thread-safe. Every call may compute for seconds: on a worker.
class RefineService {
 public:
  using Clock = std::chrono::steady_clock;
  explicit RefineService(const RefineLimits& limits = {})
      : limits_(limits), scenes_(limits.scenes) {}

  /// The whole mesh for a region, of the dataset or of a window of it; without a window of
  /// a dataset that has too many posts, one around the region. REQUIRES: errors.inside_m
  /// <= errors.outside_m.
  Result<proto::RefineDelta> region(const ServedDataset&, const GeoRegion&, const RegionErrors&,
                                    const std::optional<GeoRect>& window, std::stop_token,
                                    const std::string& client = {});

  /// What leads from the view `token` to the one of this camera; with no token the whole mesh. The
  /// answer names the new view, and the old name is gone. A view stays in its window. Fails with
  /// not_found for a token that is unknown, expired or in use.
  /// `client`: whose view it is. Where there are too many views or scenes, whoever has most loses
  /// one: nobody takes another's who has no more than he.
  Result<proto::RefineDelta> view(const ServedDataset&, const Camera&, const std::string& token,
                                  const std::optional<GeoRect>& window, std::stop_token,
                                  const std::string& client = {});

  /// False where the posts must be prepared first, which takes seconds: a first view, a region.
  bool ready(const ServedDataset&, const std::optional<GeoRect>& window) const;
  bool ready(const ServedDataset&, const GeoRegion&, const std::optional<GeoRect>& window) const;

  const RefineLimits& limits() const { return limits_; }
  std::size_t views() const;

 private:
  struct Scene {
    RefineWindow window;
    MultiTriangulation all;
    ViewGeometry geometry;
  };
  class Making;
  using Key = std::pair<std::uint32_t, RefineWindow>;
  struct View {
    std::shared_ptr<const Scene> scene;  // outlives the front
    ViewFront front;
    std::uint32_t dataset;  // its index
    std::string client;
    Clock::time_point used;
    bool moved = false;  // it has been asked for again
  };

  struct Ready {
    std::shared_ptr<const Scene> scene;
    std::string maker;  // the client for whom it was made
  };
  Result<std::shared_ptr<const Scene>> scene(const ServedDataset&,
                                             const std::optional<GeoRect>& window, std::stop_token,
                                             const std::string& client);
  void make_room_for(const std::string& client);
  static Result<std::shared_ptr<const Scene>> make(const DemSource&, const RefineWindow&,
                                                   std::stop_token);
  std::optional<GeoRect> window_of(const ServedDataset&, const GeoRegion&,
                                   const std::optional<GeoRect>& asked) const;
  std::unique_ptr<View> take(const ServedDataset&, const std::string& token);
  void keep(const std::string& token, std::unique_ptr<View>);
  void drop_views(Clock::time_point now);

  const RefineLimits limits_;
  mutable std::mutex mutex_;
  Lru<Key, Ready> scenes_;
  std::set<Key> making_;
  std::map<std::string, std::unique_ptr<View>> views_;
};

}  // namespace tind::services
