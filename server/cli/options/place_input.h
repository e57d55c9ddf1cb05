#pragma once
// Places on a command line: "7.65,45.98 7.74,46.02", or in any CRS of EPSG's list.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "server/cli/program/command_line.h"
#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"

namespace tind::cli {

/// --places-crs.
void add_places_crs(Command, std::string& crs);

/// Numbers between commas and blanks. Fails (invalid_argument) with the option's name.
Result<std::vector<double>> read_numbers(const std::string& text, const char* option);

/// Pairs X,Y of `crs` ("CRS84" or EPSG:CODE; east before north, whatever the authority has) on the
/// globe; `near`: where they are to be, roughly (CrsPoints::make). Fails (invalid_argument) with
/// the option's name.
Result<std::vector<Geographic>> read_places(const std::string& text, const char* option,
                                            const std::string& crs, Geographic near);
/// The same of points. `named`: what the i-th is called in an error.
Result<std::vector<Geographic>> to_places(std::span<const Vec2> points, const std::string& crs,
                                          Geographic near,
                                          const std::function<std::string(std::size_t)>& named);
/// Exactly one.
Result<Geographic> read_place(const std::string& text, const char* option, const std::string& crs,
                              Geographic near);

}  // namespace tind::cli
