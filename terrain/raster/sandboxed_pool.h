#pragma once
// DEMs that are read by processes of their own: a raster that crashes, hangs or bloats whatever
// decodes it costs an error, not the daemon, and one that takes its decoder over finds nothing
// there but its own file.

#include <memory>

#include "terrain/raster/dem_source.h"
#include "terrain/raster/sandbox/team.h"

namespace tind {

/// As SourcePool::make(). Sources with this pool open and read their files in the team's processes,
/// and are otherwise what they are without: the same heights, facts and fingerprints. Where a
/// process fails, so does the reading (Errc::io); the same place is tried again after a pause that
/// grows, other places at once. The limits on files are those of each process.
std::shared_ptr<SourcePool> sandboxed_pool(const SourcePool::Limits&, sandbox::TeamOptions);

/// A pool that shares everything with that one but the processes: this one reads. null: null.
std::shared_ptr<SourcePool> without_sandbox(const std::shared_ptr<SourcePool>&);

/// A pool that shares everything with that one, and refuses a DEM on another machine
/// (Errc::unsupported), for which its processes lack a network. Without that, this process reads
/// it.
std::shared_ptr<SourcePool> without_exceptions(const std::shared_ptr<SourcePool>&);

/// As is_offset_grid() of offset_grid.h, asked of a process where the pool has them.
bool is_offset_grid(const std::string& path, const std::shared_ptr<SourcePool>&);

/// The whole of such a process: what TeamOptions::command is to call. Locks itself down before it
/// looks at the first file. Returns its exit code. `tind` does nothing else when this is its only
/// argument.
inline constexpr const char* kDecoderArgument = "decode-for-daemon";
int decode_for_others();

/// One that becomes such processes (sandbox/nursery.h): what TeamOptions::nursery is to call.
inline constexpr const char* kNurseryArgument = "nursery-for-daemon";
int nurse_for_others();

}  // namespace tind
