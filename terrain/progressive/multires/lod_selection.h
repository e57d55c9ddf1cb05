#pragma once
// Which of several discrete levels of detail to show: by distance or by projected error, with
// hysteresis ([Sung], 2.1).
//
// Level 0 is the finest. Level i is good enough from distance from_m[i] on, from_m[0] = 0, and the
// coarsest that is good enough is the one to show. The rule with hysteresis h: a finer level is
// taken at once, when the shown one is no longer good enough; a coarser one only when it is good
// enough even at 1 / (1 + h) of the distance. So what is shown is always good enough, and a camera
// has to go back a share h of its distance before a switch is undone: one that trembles around a
// threshold switches once at most.

#include <span>
#include <vector>

namespace tind {

/// The distances from which levels of these errors (metres, ascending) project to at most
/// `tolerance_px`, for a camera with `pixels_per_radian` (viewport width / 2 / tan(fov / 2)).
std::vector<double> distances_of_errors(std::span<const double> errors_m, double pixels_per_radian,
                                        double tolerance_px);

/// The level to show at `distance_m` after `shown` (-1: none yet). REQUIRES: from_m ascends from 0,
/// hysteresis >= 0.
int select_level(std::span<const double> from_m, double distance_m, int shown, double hysteresis);

}  // namespace tind
