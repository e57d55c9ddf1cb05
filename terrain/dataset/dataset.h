#pragma once
// What services and commands hold: a DEM, its tiles, or both, and what is known of them.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/geo/coordinates.h"
#include "terrain/pyramid/plan/height_extremes.h"
#include "terrain/raster/draped.h"
#include "terrain/store/tile_set.h"
#include "terrain/surface/surface.h"

namespace tind {

struct TileSetOptions;

/// How to open a DEM again, in another process: its files, and its options as a command line has
/// them, by name ("from-datum") and text; paths are absolute.
struct DemRecipe {
  std::vector<std::string> files;
  std::map<std::string, std::string> words;
};

/// What a dataset says of itself, whatever it is made of.
struct DatasetFacts {
  GeoRect bounds;  // of the tiles; of the source where there are none; -180..180 across 180
  /// The same, but across the antimeridian, where it goes on beyond 180 (box_around()). Of tiles
  /// without their source to a tile.
  GeoRect box;
  std::string datum;        // what the heights are above, as name(VerticalDatum); empty: not said
  std::string attribution;  // who is to be named with it; empty: not said
  /// Of the source. Nothing where there is none, until all of it has been read, and where that
  /// failed.
  std::optional<HeightExtremes> extremes;
};

/// One of source and tiles may be missing, not both; who uses a dataset must ask. Everything that
/// can be called here is thread-safe, and copies share what they are made of.
///
/// Each kind of dataset has its file in this folder, with a function that fills these members:
/// dem_dataset.h (a source, its tiles made on demand), stored_dataset.h (tiles of a store), and
/// below what has only one of the two. Another kind is another such file; errors of opening are
/// that function's, a Dataset is whole.
struct Dataset {
  std::shared_ptr<const Surface> source;
  std::shared_ptr<const TileSet> tiles;

  /// As known by now; takes no longer than copying it.
  std::function<DatasetFacts()> facts;

  /// The same opened anew, where what lies there is another by now and has come to rest; nothing
  /// while it is as it was opened. Reads the store: not for I/O threads. Empty: it never changes.
  std::function<std::optional<Dataset>()> renewed = {};

  /// Errc::io, saying what became of it, unless what it reads is as it was opened. Asks the system
  /// once a file: not for I/O threads. Empty: nobody can tell.
  std::function<Result<void>()> unchanged = {};

  /// What its tiles are made with on demand, for what else is made of the source; null: they are
  /// not.
  std::shared_ptr<const TileSetOptions> options = {};

  /// What is draped over its 3D Tiles.
  Draped draped = {};

  /// Of the source's layers, in their order; empty: nobody said.
  std::vector<DemRecipe> recipes = {};
};

/// Where a source lies, as DatasetFacts::box.
GeoRect box_of(const DemInfo&);

/// Tiles without their source. REQUIRES: not null.
Dataset dataset_of(std::shared_ptr<const TileSet>);

/// A source without tiles, as one whose posts only answer questions. REQUIRES: not null.
Dataset dataset_of(const Surface&);

}  // namespace tind
