#pragma once
// Is the source that tiles are held against the one that they were made of? Where it is not, that
// explains what the rules find.

#include <string>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/store/build_record.h"
#include "terrain/surface/surface.h"

namespace tind {

/// One line that says in what they differ, as far as the record of the tiles tells; empty where
/// they do not. `posts`: all posts are read, too, where nothing else differs.
Result<std::string> source_note(const BuildRecord&, const Surface&, bool posts, int threads,
                                const Progress&);

}  // namespace tind
