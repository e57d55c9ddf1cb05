#include "server/services/datasets/catalog.h"

#include <algorithm>
#include <optional>

#include "proto/layer_json.h"
#include "server/services/datasets/dataset_spec.h"

namespace tind::services {
namespace {

constexpr std::size_t kMaxName = 64;

proto::Extensions offered_by(const proto::LayerJson& layer) {
  const auto has = [&](const char* name) {
    return std::ranges::find(layer.extensions, name) != layer.extensions.end();
  };
  return {has("octvertexnormals"), has("watermask"), has("metadata")};
}

std::shared_ptr<const ServedDataset> serve_as(std::uint32_t index, std::string name,
                                              Dataset dataset) {
  auto served = std::make_shared<ServedDataset>();
  static_cast<Dataset&>(*served) = std::move(dataset);
  served->index = index;
  served->name = std::move(name);
  if (!served->tiles) return served;
  proto::LayerJson layer = served->tiles->layer();
  layer.attribution = served->facts().attribution;
  served->offered = offered_by(layer);
  served->layer_json = http::Representation::make(proto::encode_layer_json(layer),
                                                  {.content_type = "application/json"});
  return served;
}

}  // namespace

const ServedDataset& Catalog::add(std::string name, Dataset dataset) {
  const std::string safe = safe_name(name);
  std::string unique = safe;
  for (int number = 2; by_name_.contains(unique); ++number) {
    const std::string suffix = std::string("-").append(std::to_string(number));
    unique = safe.substr(0, kMaxName - suffix.size()) + suffix;
  }
  by_name_[unique] = datasets_.size();
  datasets_.push_back(serve_as(next_index_++, unique, std::move(dataset)));
  return *datasets_.back();
}

std::shared_ptr<const ServedDataset> Catalog::find(std::string_view name) const {
  const auto found = by_name_.find(name);
  if (found == by_name_.end()) return nullptr;
  const std::lock_guard lock(*mutex_);
  return datasets_[found->second];
}

std::vector<std::shared_ptr<const ServedDataset>> Catalog::all() const {
  const std::lock_guard lock(*mutex_);
  return datasets_;
}

std::vector<std::string> Catalog::follow() {
  std::vector<std::string> others;
  const auto now = all();
  for (std::size_t i = 0; i < now.size(); ++i) {
    const ServedDataset& old = *now[i];
    auto renewed = old.renewed ? old.renewed() : std::nullopt;
    if (!renewed) continue;
    auto made = serve_as(next_index_++, old.name, std::move(*renewed));
    const std::lock_guard lock(*mutex_);
    datasets_[i] = std::move(made);
    others.push_back(old.name);
  }
  return others;
}

}  // namespace tind::services
