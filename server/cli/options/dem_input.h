#pragma once
// The options with which every subcommand opens a DEM, and reading one as a whole.

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/cli/program/command_line.h"
#include "terrain/base/result.h"
#include "terrain/raster/dem_source.h"
#include "terrain/raster/terrain.h"

namespace tind::cli {

/// What the user said about the input; bound to the options that `add_dem_options` adds.
struct DemInput {
  std::vector<std::string> files;
  DemOptions said;                // by the options of dem_options_text.h
  std::string to_datum = "same";  // what the subcommand does by itself: same or ellipsoid
  bool to_datum_given = false;
  std::vector<std::string> given;                          // flags, as the user wrote them
  std::vector<std::pair<std::string, std::string>> texts;  // the same by name and value
  std::vector<std::string> datums;                         // as said: some are files of geoids
  bool allow_vrt = false;
  std::optional<std::array<double, 4>> bounds;  // west, south, east, north; none: all of it
  std::string bounds_crs = "CRS84";
  bool takes_tins = false;                         // the subcommand has --posts (tin_input.h)
  double posts_m = 0;                              // of a TIN; 0: not said
  std::shared_ptr<const Environment> environment;  // the program's
};

/// Those of dem_options_text.h (--from-datum, --to-datum, --nodata ...) and --allow-vrt.
void add_dem_options(Command, DemInput&);

/// --bounds and --bounds-crs, for a subcommand that works on an area of its DEM.
void add_window_options(Command, DemInput&);

DemOptions dem_options(const DemInput&);

/// As if the user had said so. Fails as set_dem_option does.
Result<void> say_dem_option(DemInput&, const std::string& name, const std::string& text);

/// Fails (invalid_argument) where an option of DEMs was given beside a mesh, which it says nothing
/// of.
Result<void> no_dem_options(const DemInput&, const std::string& mesh);

/// Its posts within the bounds, with what should be known of it as warnings on stderr. Where the
/// subcommand takes them, those of a TIN.
Result<std::shared_ptr<const DemSource>> open_dem(const DemInput&);

/// The same for who says how wrong an answer may be.
struct OpenedDem {
  std::shared_ptr<const DemSource> dem;
  double tin_error_m = 0;  // of a TIN: no place of it is farther from the surface between posts
};
Result<OpenedDem> open_dem_or_tin(const DemInput&);

/// complain(), with the files' names where what is wrong lies in their posts.
int complain_of(const DemInput&, const Error&);

/// What is said of a DEM of which nothing can be shown (bad_data).
Error no_heights();

/// On stderr: what opening it found, and, once posts have been read, values among them that look
/// like an undeclared nodata value.
void warn_of(const DemInfo&);
void warn_of_nodata(const DemSource&);
/// Of two that are compared: nobody says what the heights of one of them are above.
void warn_of_datums(const DemInfo&, const DemInfo&);

/// "the DEM's accuracy, as stated: 4 m (le90)", a line for the end of a report; empty where nobody
/// stated it.
std::string accuracy_line(const DemInfo&);

/// All posts at once, with a warning of undeclared nodata. Fails (out_of_range) for a source too
/// large for one mesh.
Result<Terrain> read_all(const DemSource&);

}  // namespace tind::cli
