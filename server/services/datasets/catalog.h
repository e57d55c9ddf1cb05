#pragma once
// The datasets that a daemon serves: opened at start, looked up by name. One whose store gets other
// tiles is opened anew, and is another dataset of the same name: nothing that was made of the old
// one, cached or on its way, is taken for the new one's.

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "proto/quantized_mesh.h"
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
  /// `name` is made safe, and numbered ("alps-2") where it is taken.
  const ServedDataset& add(std::string name, Dataset);

  /// Null when there is none of that name. Thread-safe, like all().
  std::shared_ptr<const ServedDataset> find(std::string_view name) const;
  /// In the order they were added.
  std::vector<std::shared_ptr<const ServedDataset>> all() const;

  /// Takes what Dataset::renewed() gives in place of the old one, and names those. One that cannot
  /// be opened yet stays as it was, to be looked at the next time. One thread at a time.
  std::vector<std::string> follow();

 private:
  std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();  // of what is here
  std::vector<std::shared_ptr<const ServedDataset>> datasets_;
  std::map<std::string, std::size_t, std::less<>> by_name_;
  std::uint32_t next_index_ = 0;
};

}  // namespace tind::services
