#include "server/services/datasets/catalog.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "proto/tile/layer_json.h"
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

std::string free_name(std::string_view name, const std::function<bool(const std::string&)>& taken) {
  const std::string safe = safe_name(name);
  std::string unique = safe;
  for (int number = 2; taken(unique); ++number) {
    const std::string suffix = std::string("-").append(std::to_string(number));
    unique = safe.substr(0, kMaxName - suffix.size()) + suffix;
  }
  return unique;
}

const ServedDataset& Catalog::add(const std::string& name, Dataset dataset) {
  Datasets datasets = all();
  const auto taken = [this](const std::string& one) { return find(one) != nullptr; };
  datasets.push_back(make(free_name(name, taken), std::move(dataset)));
  const ServedDataset& added = *datasets.back();
  replace(std::move(datasets));
  return added;
}

std::shared_ptr<const Catalog::State> Catalog::now() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::shared_ptr<const ServedDataset> Catalog::find(std::string_view name) const {
  const auto state = now();
  const auto found = state->by_name.find(name);
  return found == state->by_name.end() ? nullptr : state->datasets[found->second];
}

Catalog::Datasets Catalog::all() const { return now()->datasets; }

std::uint64_t Catalog::revision() const { return now()->revision; }

std::shared_ptr<const ServedDataset> Catalog::make(std::string name, Dataset dataset) {
  return serve_as(next_index_++, std::move(name), std::move(dataset));
}

void Catalog::replace(Datasets datasets) {
  auto made = std::make_shared<State>();
  for (std::size_t i = 0; i < datasets.size(); ++i) made->by_name[datasets[i]->name] = i;
  made->datasets = std::move(datasets);
  std::shared_ptr<const State> old;  // goes after the lock
  const std::lock_guard lock(mutex_);
  made->revision = state_->revision + 1;
  old = std::exchange(state_, std::move(made));
}

std::vector<std::string> Catalog::follow() {
  std::vector<std::string> others;
  Datasets datasets = all();
  for (auto& dataset : datasets) {
    auto renewed = dataset->renewed ? dataset->renewed() : std::nullopt;
    if (!renewed) continue;
    dataset = make(dataset->name, std::move(*renewed));
    others.push_back(dataset->name);
  }
  if (!others.empty()) replace(std::move(datasets));
  return others;
}

}  // namespace tind::services
