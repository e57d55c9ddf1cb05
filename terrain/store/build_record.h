#pragma once
// How the tiles of a store were made: what a build notes beside them, and goes by when it is run
// again.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "terrain/geo/coordinates.h"

namespace tind {

/// One layer of the surface that tiles were made of: where its posts were, and what of it decided
/// which tiles there are. What an update with other files or layers is told from.
struct LayerRecord {
  std::string crs;  // digest of the CRS, of its way to longitude and latitude, of the datum
  Affine post_to_crs;
  std::int64_t cols = 0, rows = 0;
  std::int64_t files = 1;
  bool plain = false, wraps = false;  // DemSource::is_plain_geographic(), DemInfo::wraps_longitude
  double period_cols = 0, spacing_x_m = 1, spacing_y_m = 1, rounding_m = 0;  // as in DemInfo
  double blend_m = 0, max_error_m = 0;                                       // as in SurfaceLayer
  GeoRect bounds;
  std::vector<GeoRect> extents;

  /// The same grid, continued: same CRS and steps, posts at the same places.
  bool continues(const LayerRecord&) const;
  /// Is there a place that both have posts around?
  bool meets(const LayerRecord&) const;
  /// Its posts are numbered from the same corner, too, and placed by the same arithmetic.
  bool same_lattice(const LayerRecord&) const;
};

/// Everything that the bytes of the tiles depend on.
struct BuildRecord {
  int epoch = 0;            // of the program: others make other bytes of the same posts
  std::string grid;         // digest of where the posts are and what their heights mean
  std::string heights;      // digest of the heights
  double max_error_m = 0;   // at the leaves
  double error_factor = 0;  // of the budgets of all levels; 0 where the record does not say
  int deepest_level = -1;   // where the pyramid ends
  int first_level = 0, last_level = -1;  // those that were made
  std::string side = "both";
  std::string vertical_datum;
  std::string effort;
  std::string method;            // with its options; empty: bounded
  std::string drape;             // fingerprint of the image for whose sake it makes meshes
  bool gzip = false;             // the tiles are stored compressed
  std::int64_t exact_posts = 0;  // 0: not asked for
  std::string tiles;             // digest of which tiles there are; empty: rectangles
  std::vector<double> steps_m;   // by level: the step of heights on borders
  std::string shapes;            // stands for the lines and the water; empty: there are none
  std::string shape_levels;      // and this for their levels, which go by the heights
  int layer_epoch = 0;           // of tiles of several layers or files: as epoch; 0: of one file
  int asked_deepest = -1;        // by an option; -1: by the posts
  /// The lowest first. Empty: of a version that did not note them.
  std::vector<LayerRecord> layers;
  std::pair<double, double> range_m;                      // of all heights
  std::vector<std::pair<double, double>> level_ranges_m;  // by level, where they differ (layers)
};

/// Can tiles of the one become tiles of the other by an update: are they made alike, of surfaces
/// that have the grid of a layer in common, and some of its ground?
bool may_update(const BuildRecord& from, const BuildRecord& to);

/// The text that is kept: the same record, the same text.
std::string encode(const BuildRecord&);

/// Whatever the text says of it: what is missing or of another kind stays as it is by default.
/// Nothing where it is not a JSON object. Says nothing about who wrote it.
std::optional<BuildRecord> decode_build_record(std::string_view text);

}  // namespace tind
