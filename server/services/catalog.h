#pragma once
// The datasets that a daemon serves: opened once at start, looked up by name.

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "proto/quantized_mesh.h"
#include "server/http/representation.h"
#include "terrain/pyramid/tileset.h"

namespace tind::services {

struct Dataset {
  std::uint32_t index = 0;
  std::string name;
  std::vector<std::string> files;
  std::unique_ptr<const TileSet> tiles;
  proto::Extensions offered;  // what its tiles carry
  std::shared_ptr<const http::Representation> layer_json;
};

/// [A-Za-z0-9._-]{1,64}, not beginning with a dot: what is not is replaced by '_'.
std::string safe_name(std::string_view text);

class Catalog {
 public:
  /// `name` is made safe, and numbered ("alps-2") where it is taken.
  const Dataset& add(std::string name, std::vector<std::string> files,
                     std::unique_ptr<const TileSet>);

  /// Null when there is none of that name.
  const Dataset* find(std::string_view name) const;
  const std::vector<std::unique_ptr<const Dataset>>& all() const { return datasets_; }

 private:
  std::vector<std::unique_ptr<const Dataset>> datasets_;  // in the order they were added
  std::map<std::string, const Dataset*, std::less<>> by_name_;
};

}  // namespace tind::services
