#pragma once
// A server's tiles as a store: other people's tile sets, to be looked at.

#include <memory>
#include <string>

#include "terrain/raster/url_reader.h"
#include "terrain/store/tile_store.h"

namespace tind {

bool is_url(const std::string& text);

/// `url`: http(s)://.../NAME or .../NAME/layer.json. Tiles are where the first template of
/// layer.json says, which is fetched once; without one at NAME/z/x/y.terrain. The reader must
/// outlive it. `key` goes to the URL's own server, and to no other that layer.json names.
std::unique_ptr<TileStore> url_store(const std::string& url, const UrlReader&,
                                     const std::string& key = {});

/// What is behind a URL, asked for as a globe client would.
Result<std::vector<std::uint8_t>> fetch_tile(const UrlReader&, const std::string& url,
                                             const std::string& key = {});

}  // namespace tind
