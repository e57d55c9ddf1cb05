#pragma once
// Whether there is anything to be shown of a surface.

#include "terrain/base/result.h"
#include "terrain/surface/surface.h"

namespace tind {

/// Has any post of any layer a height? Reads until it meets one: a block as a rule, all posts of a
/// surface of voids. Fails with the sources' errors.
Result<bool> any_height(const Surface&);

}  // namespace tind
