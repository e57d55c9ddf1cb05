#include "terrain/store/archive_writer.h"

#include "terrain/base/hash.h"

namespace tind {

std::uint64_t ArchiveHead::seed() const { return hash64(record_text, hash64(layer_text)); }

}  // namespace tind
