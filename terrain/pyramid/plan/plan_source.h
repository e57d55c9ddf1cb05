#pragma once
// What must be known of a source before its first tile: the range of its heights, and for a large
// one its residual index. One pass over all posts, or a look into the index that is there.

#include <memory>
#include <span>
#include <string>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/pyramid/plan/level_plan.h"
#include "terrain/pyramid/plan/tile_set_options.h"
#include "terrain/pyramid/residual/residual_index.h"
#include "terrain/surface/surface.h"

namespace tind {

/// The index of a source, made if need be; null where no tile of the plan rests on one
/// (TilePlan::index_depth). `path`: where it is or is to be; empty: nowhere, it goes with the last
/// who holds it; `parts`: what others have made of it. Fails as ResidualIndex::open_or_make does.
Result<std::shared_ptr<const ResidualIndex>> index_for(const Surface&, const TilePlan&,
                                                       const std::string& path, int threads = 0,
                                                       const Progress& = {},
                                                       std::span<const IndexPart> parts = {});

/// The plan of a source, with its index. Fails as TilePlan::make and index_for do, and where posts
/// cannot be read. `content`: becomes 32 digits that stand for all heights (source_blocks.h), where
/// they are read: of one DEM nothing does where the index says what is needed of them. Of layers
/// the index does not know the posts that lie below others: what is needed of those is kept in a
/// file beside it, `index_path`.range (kept_range.h).
Result<TilePlan> plan_source(const Surface&, const TileSetOptions&, const std::string& index_path,
                             int threads = 0, const Progress& = {}, std::string* content = nullptr);

}  // namespace tind
