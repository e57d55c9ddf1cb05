#pragma once
// The datasets that a daemon serves, looked up by name. They change all at once: who asks finds the
// old ones or the new ones. One that is opened anew is another dataset of the same name: nothing
// that was made of the old one, cached or on its way, is taken for the new one's.

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "proto/tile/quantized_mesh.h"
#include "server/http/message/representation.h"
#include "terrain/dataset/dataset.h"
#include "terrain/geo/tiling_scheme.h"

namespace tind::services {

/// A dataset under its name, with what is the same for every request. Whoever works on it later
/// than now keeps the shared_ptr: the catalog may have let it go.
struct ServedDataset : Dataset, std::enable_shared_from_this<ServedDataset> {
  std::uint32_t index = 0;  // no other has it, nor will
  std::string name;
  proto::Extensions offered;                               // what its tiles carry
  std::shared_ptr<const http::Representation> layer_json;  // null: it has no tiles

  bool has(TileId id) const { return tiles && tiles->available(id); }
};

class Catalog {
 public:
  using Datasets = std::vector<std::shared_ptr<const ServedDataset>>;

  /// `name` is made safe, and numbered ("alps-2") where it is taken.
  const ServedDataset& add(const std::string& name, Dataset);

  /// Null when there is none of that name. Thread-safe, like all that follows.
  std::shared_ptr<const ServedDataset> find(std::string_view name) const;
  /// In the order they were added.
  Datasets all() const;
  /// Another number whenever there are other datasets.
  std::uint64_t revision() const;

  /// A dataset that is not in the catalog yet, for replace(). REQUIRES: a safe name.
  std::shared_ptr<const ServedDataset> make(std::string name, Dataset);
  /// These in place of all there are, whose last users end with them. REQUIRES: no name twice.
  void replace(Datasets);

  /// Takes what Dataset::renewed() gives in place of the old one, and names those. One that cannot
  /// be opened yet stays as it was, to be looked at the next time. One thread at a time, which is
  /// the one that replaces.
  std::vector<std::string> follow();

 private:
  struct State {
    Datasets datasets;
    std::map<std::string, std::size_t, std::less<>> by_name;
    std::uint64_t revision = 0;
  };
  std::shared_ptr<const State> now() const;

  mutable std::mutex mutex_;  // of the pointer
  std::shared_ptr<const State> state_ = std::make_shared<State>();
  std::atomic<std::uint32_t> next_index_{0};
};

/// `name` made safe, and numbered ("alps-2") until `taken` says no.
std::string free_name(std::string_view name, const std::function<bool(const std::string&)>& taken);

}  // namespace tind::services
