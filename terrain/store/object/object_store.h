#pragma once
// Objects of an S3 store as a tile set that is read: those below a prefix, one a file of a folder.

#include <memory>
#include <string>

#include "terrain/raster/remote/objects.h"
#include "terrain/store/tile_store.h"

namespace tind {

/// s3://BUCKET/PREFIX, also with /layer.json: as object_writer.h, or whoever copied a folder there,
/// leaves them. With a ledger beside them every tile is held against it; it is fetched once, 64
/// bytes a tile. A tile that is other than the ledger says, in a store that has a new one: busy.
std::unique_ptr<TileStore> object_store(const std::string& url, const remote::Objects&);

/// Without "/layer.json" and slashes at the end.
std::string object_prefix(std::string url);

}  // namespace tind
