#include "server/services/catalog.h"

#include <algorithm>

#include "proto/layer_json.h"

namespace tind::services {
namespace {

constexpr std::size_t kMaxName = 64;

proto::Extensions offered_by(const proto::LayerJson& layer) {
  const auto has = [&](const char* name) {
    return std::ranges::find(layer.extensions, name) != layer.extensions.end();
  };
  return {has("octvertexnormals"), has("watermask"), has("metadata")};
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
                            std::unique_ptr<const TileSet> tiles) {
  const std::string safe = safe_name(name);
  std::string unique = safe;
  for (int number = 2; by_name_.contains(unique); ++number) {
    const std::string suffix = std::string("-").append(std::to_string(number));
    unique = safe.substr(0, kMaxName - suffix.size()) + suffix;
  }
  auto dataset = std::make_unique<Dataset>();
  dataset->index = std::uint32_t(datasets_.size());
  dataset->name = unique;
  dataset->files = std::move(files);
  dataset->offered = offered_by(tiles->layer());
  dataset->layer_json = http::Representation::make(proto::encode_layer_json(tiles->layer()),
                                                   {.content_type = "application/json"});
  dataset->tiles = std::move(tiles);
  by_name_[unique] = dataset.get();
  datasets_.push_back(std::move(dataset));
  return *datasets_.back();
}

const Dataset* Catalog::find(std::string_view name) const {
  const auto found = by_name_.find(name);
  return found == by_name_.end() ? nullptr : found->second;
}

}  // namespace tind::services
