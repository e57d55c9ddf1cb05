#include "terrain/surface/stated_accuracy.h"

namespace tind {

std::vector<proto::StatedAccuracy> stated_accuracy(const Surface& surface) {
  std::vector<proto::StatedAccuracy> stated;
  for (const SurfaceLayer& layer : surface.layers()) {
    const auto& accuracy = layer.source->info().accuracy;
    if (!accuracy) continue;
    stated.push_back({.layer = surface.only() ? std::string() : layer.name,
                      .kind = name_of(accuracy->kind),
                      .metres = accuracy->metres});
  }
  return stated;
}

}  // namespace tind
