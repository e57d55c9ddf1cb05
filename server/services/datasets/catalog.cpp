#include "server/services/datasets/catalog.h"

#include <algorithm>

#include "proto/layer_json.h"
#include "terrain/store/open/stored_tiles.h"

namespace tind::services {
namespace {

constexpr std::size_t kMaxName = 64;

proto::Extensions offered_by(const proto::LayerJson& layer) {
  const auto has = [&](const char* name) {
    return std::ranges::find(layer.extensions, name) != layer.extensions.end();
  };
  return {has("octvertexnormals"), has("watermask"), has("metadata")};
}

std::shared_ptr<const Dataset> make_dataset(std::uint32_t index, std::string name,
                                            std::vector<std::string> files,
                                            std::unique_ptr<const TileSet> tiles,
                                            std::optional<std::uint64_t> generation) {
  auto dataset = std::make_shared<Dataset>();
  dataset->index = index;
  dataset->name = std::move(name);
  dataset->files = std::move(files);
  dataset->offered = offered_by(tiles->layer());
  dataset->layer_json = http::Representation::make(proto::encode_layer_json(tiles->layer()),
                                                   {.content_type = "application/json"});
  dataset->tiles = std::move(tiles);
  dataset->generation = generation;
  return dataset;
}

}  // namespace

std::string safe_name(std::string_view text) {
  std::string name(text.substr(0, kMaxName));
  for (char& c : name) {
    const bool fine = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                      c == '.' || c == '_' || c == '-';
    if (!fine) c = '_';
  }
  if (name.empty()) return "dataset";
  if (name[0] == '.') name[0] = '_';
  return name;
}

const Dataset& Catalog::add(std::string name, std::vector<std::string> files,
                            std::unique_ptr<const TileSet> tiles,
                            std::optional<std::uint64_t> generation) {
  const std::string safe = safe_name(name);
  std::string unique = safe;
  for (int number = 2; by_name_.contains(unique); ++number) {
    const std::string suffix = std::string("-").append(std::to_string(number));
    unique = safe.substr(0, kMaxName - suffix.size()) + suffix;
  }
  by_name_[unique] = datasets_.size();
  datasets_.push_back(
      make_dataset(next_index_++, unique, std::move(files), std::move(tiles), generation));
  return *datasets_.back();
}

std::shared_ptr<const Dataset> Catalog::find(std::string_view name) const {
  const auto found = by_name_.find(name);
  if (found == by_name_.end()) return nullptr;
  const std::lock_guard lock(*mutex_);
  return datasets_[found->second];
}

std::vector<std::shared_ptr<const Dataset>> Catalog::all() const {
  const std::lock_guard lock(*mutex_);
  return datasets_;
}

std::vector<std::string> Catalog::follow() {
  std::vector<std::string> others;
  const auto now = all();
  for (std::size_t i = 0; i < now.size(); ++i) {
    const Dataset& old = *now[i];
    if (!old.generation) continue;
    const auto generation = stored_generation(old.files[0]);
    if (!generation || generation == old.generation) continue;
    auto tiles = open_stored_tiles(old.files[0]);
    // A folder that changes while it is opened is opened when it has come to rest.
    if (!tiles || stored_generation(old.files[0]) != generation) continue;
    auto made = make_dataset(next_index_++, old.name, old.files, std::move(*tiles), generation);
    const std::lock_guard lock(*mutex_);
    datasets_[i] = std::move(made);
    others.push_back(old.name);
  }
  return others;
}

}  // namespace tind::services
