#pragma once
// The picture of `tind explain --png`.

#include "server/cli/pictures/png.h"
#include "terrain/base/result.h"
#include "terrain/check/explain.h"
#include "terrain/surface/surface.h"

namespace tind::cli {

/// The tile seen from above, true to scale at its middle, about 1024 pixels high. The ground is
/// shaded by the source's relief (by the mesh's own where there is no source) and coloured by the
/// mesh's error: blue below the source, red above, full at the tile's largest error; filled voids
/// are yellow. The mesh's edges lie over it, a ring around the worst post.
Result<Picture> explain_picture(const TileExplanation&, const Surface*);

}  // namespace tind::cli
