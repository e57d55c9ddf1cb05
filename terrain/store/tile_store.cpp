#include "terrain/store/tile_store.h"

#include "terrain/base/deflate.h"

namespace tind {

bool gunzip(std::vector<std::uint8_t>& bytes) {
  if (!is_gzip(bytes)) return true;
  auto out = gunzip(bytes, kLargestStored);
  if (out) bytes = std::move(*out);
  return out.has_value();
}

}  // namespace tind
