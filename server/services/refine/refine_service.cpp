// A view is taken out of the table while it is worked on, so two requests can never move one front
// at a time; it goes back under a new name. A scene is made by one worker; others that want it
// meanwhile are told to come again, so that they do not hold workers that only wait.

#include "server/services/refine/refine_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <random>
#include <string_view>
#include <tuple>

#include "terrain/progressive/multires/levelled_collapse.h"
#include "terrain/surface/void_fill.h"

namespace tind::services {

namespace {

using Index = Front::Index;

std::string new_token() {
  std::random_device device;  // the system's generator: tokens cannot be guessed
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", std::uint32_t(device()));
  return token;
}

proto::RefineDelta empty_delta(const ViewGeometry& geometry) {
  proto::RefineDelta d;
  const LocalFrame& f = geometry.frame;
  d.lon = std::atan2(f.up.y, f.up.x) * 180 / 3.14159265358979323846;
  d.lat = f.lat_deg;
  return d;
}

void add(proto::RefineDelta& d, const MultiTriangulation& all, const ViewGeometry& geometry,
         const std::vector<Index>& vertices, const std::vector<Index>& triangles) {
  for (const Index v : vertices) d.vertices.push_back({v, geometry.position[v]});
  for (const Index t : triangles) d.triangles.push_back({t, all.corners(t)});
}

proto::RefineDelta whole_mesh(const MultiTriangulation& all, const ViewGeometry& geometry,
                              const Front& front) {
  proto::RefineDelta d = empty_delta(geometry);
  d.whole = true;
  std::vector<Index> triangles = front.active_triangles(), vertices;
  std::sort(triangles.begin(), triangles.end());
  for (const Index t : triangles)
    vertices.insert(vertices.end(), all.corners(t).begin(), all.corners(t).end());
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  add(d, all, geometry, vertices, triangles);
  return d;
}

/// What a scene is made of: null where there are only tiles, or layers.
const DemSource* dem_of(const ServedDataset& dataset) {
  return dataset.source ? dataset.source->only() : nullptr;
}

std::unexpected<Error> no_dem(const ServedDataset& dataset) {
  if (dataset.source)
    return fail(Errc::unsupported, "this dataset has layers; only one DEM can be refined");
  return fail(Errc::not_found, "this dataset is a store of tiles without its DEM");
}

}  // namespace

Result<std::shared_ptr<const RefineService::Scene>> RefineService::make(const DemSource& dem,
                                                                        const RefineWindow& window,
                                                                        std::stop_token stop) {
  auto posts = dem.read(window.col, window.row, window.cols, window.rows);
  if (!posts) return std::unexpected(posts.error());
  // Filled as in the tiles: who flies over a hole in the data sees ground, not sky.
  auto grid = fill_voids(dem, std::move(*posts), window.col, window.row);
  if (!grid) return std::unexpected(grid.error());
  auto all = levelled_terrain(terrain_of(std::move(*grid), dem.info()), {},
                              {.report = {}, .stop = std::move(stop)});
  if (!all) return std::unexpected(all.error());
  auto geometry = view_geometry(*all, dem, window.col, window.row);
  if (!geometry) return std::unexpected(geometry.error());
  return std::make_shared<const Scene>(window, std::move(*all), std::move(*geometry));
}

/// Whatever happens while it is made, it can be asked for again.
class RefineService::Making {
 public:
  Making(RefineService& service, Key key) : service_(service), key_(std::move(key)) {}
  Making(const Making&) = delete;
  Making& operator=(const Making&) = delete;
  ~Making() {
    const std::lock_guard lock(service_.mutex_);
    service_.making_.erase(key_);
  }

 private:
  RefineService& service_;
  const Key key_;
};

Result<std::shared_ptr<const RefineService::Scene>> RefineService::scene(
    const ServedDataset& dataset, const std::optional<GeoRect>& asked, std::stop_token stop,
    const std::string& client) {
  const DemSource* const dem = dem_of(dataset);
  if (!dem) return no_dem(dataset);
  if (dem->info().cols < 2 || dem->info().rows < 2)
    return fail(Errc::unsupported, "a DEM of one row or column has no triangles");
  const auto window = refine_window(*dem, asked, limits_.posts);
  if (!window) return std::unexpected(window.error());
  const Key key{dataset.index, *window};
  {
    const std::lock_guard lock(mutex_);
    if (const auto* known = scenes_.find(key)) return known->scene;
    if (making_.size() >= limits_.scenes || !making_.insert(key).second)
      return fail(Errc::busy, "this or other data are being made ready for refining: try again");
  }
  const Making making(*this, key);
  auto made = make(*dem, *window, std::move(stop));
  if (!made) return made;
  const std::lock_guard lock(mutex_);
  make_room_for(client);
  scenes_.insert(key, {*made, client});
  return made;
}

/// For one more scene. A scene is theirs who look at it, or of whoever had it made; of several, his
/// who has fewest.
void RefineService::make_room_for(const std::string& client) {
  while (scenes_.size() >= std::max<std::size_t>(1, limits_.scenes)) {
    std::map<const Scene*, std::set<std::string_view>> holders;
    for (const auto& [token, view] : views_) holders[view->scene.get()].insert(view->client);
    for (const auto& one : scenes_.entries())
      if (auto& of_it = holders[one.value.scene.get()]; of_it.empty())
        of_it.insert(one.value.maker);
    std::map<std::string_view, std::size_t> held;
    ++held[client];
    for (const auto& [scene, clients] : holders)
      for (const std::string_view holder : clients) ++held[holder];
    const auto share = [&](const auto& one) {
      std::size_t least = ~std::size_t(0);
      for (const std::string_view holder : holders[one.value.scene.get()])
        least = std::min(least, held[holder]);
      return least;
    };
    auto goes = scenes_.entries().begin();  // the most recently used comes first
    for (auto one = goes; one != scenes_.entries().end(); ++one)
      if (share(*one) >= share(*goes)) goes = one;
    std::erase_if(views_, [&](const auto& v) { return v.second->scene == goes->value.scene; });
    const Key key = goes->key;
    scenes_.take_if([&](const Key& k) { return k == key; });
  }
}

bool RefineService::ready(const ServedDataset& dataset, const std::optional<GeoRect>& asked) const {
  const DemSource* const dem = dem_of(dataset);
  if (!dem) return true;  // it fails at once
  const auto window = refine_window(*dem, asked, limits_.posts);
  if (!window) return true;
  const Key key{dataset.index, *window};
  const std::lock_guard lock(mutex_);
  return scenes_.peek(key) != nullptr;
}

bool RefineService::ready(const ServedDataset& dataset, const GeoRegion& region,
                          const std::optional<GeoRect>& asked) const {
  return !dem_of(dataset) || ready(dataset, window_of(dataset, region, asked));
}

/// A region of what is too large brings its own window.
std::optional<GeoRect> RefineService::window_of(const ServedDataset& dataset,
                                                const GeoRegion& region,
                                                const std::optional<GeoRect>& asked) const {
  const DemInfo& info = dataset.source->info();
  if (asked || std::size_t(info.cols) * std::size_t(info.rows) <= limits_.posts) return asked;
  return around(region);
}

Result<proto::RefineDelta> RefineService::region(const ServedDataset& dataset,
                                                 const GeoRegion& region,
                                                 const RegionErrors& errors,
                                                 const std::optional<GeoRect>& window,
                                                 std::stop_token stop, const std::string& client) {
  const DemSource* const dem = dem_of(dataset);
  if (!dem) return no_dem(dataset);
  if (dem->info().cols < 2 || dem->info().rows < 2)
    return fail(Errc::unsupported, "a DEM of one row or column has no triangles");
  if (const auto valid = region.over(*dem); !valid) return std::unexpected(valid.error());
  const auto ready = scene(dataset, window_of(dataset, region, window), std::move(stop), client);
  if (!ready) return std::unexpected(ready.error());
  const Scene& s = **ready;
  const auto over = region.over(*dem, s.window.col, s.window.row);
  if (!over) return std::unexpected(over.error());
  const RegionErrors inner = within_rounding(errors, dem->info().rounding_m);
  return whole_mesh(s.all, s.geometry, refine_region(s.all, *over, inner));
}

Result<proto::RefineDelta> RefineService::view(const ServedDataset& dataset, const Camera& camera,
                                               const std::string& token,
                                               const std::optional<GeoRect>& window,
                                               std::stop_token stop, const std::string& client) {
  std::unique_ptr<View> view;
  if (token.empty()) {
    const auto ready = scene(dataset, window, std::move(stop), client);
    if (!ready) return std::unexpected(ready.error());
    const Scene& s = **ready;
    view = std::make_unique<View>(*ready, ViewFront(s.all, s.geometry), dataset.index, client,
                                  Clock::now());
  } else if (view = take(dataset, token); !view) {
    return fail(Errc::not_found, "this view is unknown or has expired: start again without one");
  }
  const Scene& s = *view->scene;
  view->moved = !token.empty();
  view->front.look(camera);
  const FrontChange change = view->front.take_change();
  proto::RefineDelta d;
  if (token.empty()) {
    d = whole_mesh(s.all, s.geometry, view->front.front());
  } else {
    d = empty_delta(s.geometry);
    d.removed_triangles = change.removed_triangles;
    d.removed_vertices = change.removed_vertices;
    add(d, s.all, s.geometry, change.added_vertices, change.added_triangles);
  }
  d.view = new_token();
  keep(d.view, std::move(view));
  return d;
}

std::unique_ptr<RefineService::View> RefineService::take(const ServedDataset& dataset,
                                                         const std::string& token) {
  const std::lock_guard lock(mutex_);
  drop_views(Clock::now());
  const auto found = views_.find(token);
  if (found == views_.end() || found->second->dataset != dataset.index) return nullptr;
  (void)scenes_.find(Key{dataset.index, found->second->scene->window});  // is in use
  return std::move(views_.extract(found).mapped());
}

void RefineService::keep(const std::string& token, std::unique_ptr<View> view) {
  const std::lock_guard lock(mutex_);
  // Its scene may have gone meanwhile, and would live on with it.
  if (std::ranges::none_of(scenes_.entries(),
                           [&](const auto& s) { return s.value.scene == view->scene; }))
    return;
  view->used = Clock::now();
  views_.emplace(token, std::move(view));
  drop_views(Clock::now());
}

/// Those too old; then, until the rest is within the limits, one of whoever has most: a client that
/// makes many views takes no other's. Behind a proxy all are one client, so what was never asked
/// for again goes first.
void RefineService::drop_views(Clock::time_point now) {
  std::erase_if(views_, [&](const auto& v) { return now - v.second->used > limits_.view_age; });
  std::size_t bytes = 0;
  for (const auto& [token, view] : views_) bytes += view->front.memory_bytes();
  while (!views_.empty() && (views_.size() > limits_.views || bytes > limits_.view_bytes)) {
    std::map<std::string_view, std::size_t> held;
    for (const auto& [token, view] : views_) ++held[view->client];
    const auto least = std::ranges::min_element(views_, {}, [&](const auto& v) {
      return std::tuple(-std::ptrdiff_t(held[v.second->client]), v.second->moved, v.second->used);
    });
    bytes -= least->second->front.memory_bytes();
    views_.erase(least);
  }
}

std::size_t RefineService::views() const {
  const std::lock_guard lock(mutex_);
  return views_.size();
}

}  // namespace tind::services
