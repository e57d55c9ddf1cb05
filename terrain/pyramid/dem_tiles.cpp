// A DEM as a tile set: every tile made when asked for.

#include "terrain/pyramid/make_tile.h"
#include "terrain/pyramid/tileset.h"

namespace tind {

namespace {

class DemTiles : public TileSet {
 public:
  DemTiles(std::shared_ptr<const DemSource> source, TilePlan plan, std::string name)
      : source_(std::move(source)), plan_(std::move(plan)), layer_(plan_.layer(name)) {}

  const proto::LayerJson& layer() const override { return layer_; }
  bool available(TileId id) const override { return plan_.available(id); }
  Result<TileBytes> tile(TileId id, std::stop_token stop) const override {
    if (!available(id)) return fail(Errc::not_found, "no tile " + id.text() + " in this dataset");
    return make_tile(*source_, plan_, id, stop);
  }
  const DemSource* dem() const override { return source_.get(); }

 private:
  std::shared_ptr<const DemSource> source_;
  TilePlan plan_;
  proto::LayerJson layer_;
};

}  // namespace

Result<std::unique_ptr<TileSet>> open_dem_tiles(std::shared_ptr<const DemSource> source,
                                                const TileSetOptions& options) {
  const auto range = scan_heights(*source);
  if (!range) return std::unexpected(range.error());
  auto plan = TilePlan::make(source->info(), *range, options);
  if (!plan) return std::unexpected(plan.error());
  const std::string& file = source->info().files.front();
  const std::string name = file.substr(file.find_last_of('/') + 1);
  return std::make_unique<DemTiles>(std::move(source), std::move(*plan),
                                    name.substr(0, name.find('.')));
}

}  // namespace tind
