#pragma once

namespace tind {

/// However coarse a level is, its tiles are fitted as exactly as this, metres: a globe seen from
/// afar still has its mountains. (Tiles that rest on the residual index take their whole budget.)
inline constexpr double kLargestError_m = 500;

}  // namespace tind
