#pragma once
// What the program of a job says on its standard error, and how it ended, for the client who asked
// for the job: without the paths of the machine it ran on.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tind::services {

/// How far it is, in per cent, where a line says that: "bounded: 30 %, 5 s left".
std::optional<int> progress_in(std::string_view line);

/// A message of 500 bytes at most, in which no path is left: the `names` of some stand for them, of
/// what is in `folder` there is the rest of the path, of all others "...".
std::string for_client(std::string message, const std::string& folder,
                       const std::vector<std::pair<std::string, std::string>>& names);

/// Does somebody else end programs so, or a system that has no memory left?
bool from_outside(int signal);
std::string why_killed(int signal);

inline constexpr const char* kNoRoomForResults =
    "the results of earlier jobs fill what there is for them: dismiss some, or wait until they "
    "expire";
inline constexpr const char* kNoRoomForYourResults =
    "the results of your earlier jobs fill what one client may keep: dismiss some, or wait until "
    "they expire";
/// `bytes`: as large as results may be.
std::string result_too_large(std::uint64_t bytes);

}  // namespace tind::services
