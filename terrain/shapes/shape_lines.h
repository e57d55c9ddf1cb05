#pragma once
// The lines that tiles have as edges: shores of level polygons, and breaklines. Which of them count
// on a level, where they cross a tile's edge, and what of them lies in a tile.

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "terrain/geo/coordinates.h"
#include "terrain/shapes/shape_network.h"

namespace tind {

/// A line between places where lines meet or end, or all around.
struct ShapeChain {
  std::vector<Vec3>
      points;  // x = lon, y = lat, z: own height in metres or NaN; closed: first = last
  /// Of the water, for a shore; NaN: a breakline.
  double level_m = std::numeric_limits<double>::quiet_NaN();
  std::uint32_t network = 0;  // what hangs together has one number
  bool water_left = false;    // of a shore, seen along it
  bool shore() const { return level_m == level_m; }
};

/// What is known of lines that hang together.
struct ShapeExtent {
  double size_deg = 0;  // the larger side of the box around, of latitude
  double relief_m = 0;  // how far posts inside, but not in level polygons, are from the level
};

/// What a level of tiles asks of lines.
struct LineScale {
  double least_deg = 0;   // smaller ones do not count ...
  double relief_m = 0;    // ... unless their relief is more than this
  double finest_deg = 0;  // and they are not smaller than this
  double step_m = 0;      // levels are multiples of this
  double level(double level_m) const;
};

/// Where a line crosses the edge of a tile.
struct ShapeCrossing {
  double t = 0;         // 0..32767 from the edge's start
  double height_m = 0;  // a shore's level, a breakline's own height; NaN: the surface's
  bool shore = false;
};

/// A part of a chain inside a rectangle.
struct ShapePiece {
  struct End {
    int side = -1;  // TileSide, where it crosses an edge; -1: it ends inside
    double t = 0;   // as ShapeCrossing
  };
  const ShapeChain* chain = nullptr;
  std::vector<Vec3> points;  // u, v (not rounded), own height; the crossings left out
  End from, to;
  bool closed = false;  // the whole of a chain that closes
};

class ShapeLines {
 public:
  ShapeLines() = default;
  ShapeLines(std::vector<ShapeChain> chains, std::vector<ShapeExtent> networks);

  bool empty() const { return chains_.empty(); }
  const std::vector<ShapeChain>& chains() const { return chains_; }
  const std::vector<ShapeExtent>& networks() const { return networks_; }

  /// Whether a chain counts: a function of what hangs together and of the level alone.
  bool counts(const ShapeChain&, const LineScale&) const;
  /// Of an edge that runs north or east, by t. The same for the tiles on both sides.
  std::vector<ShapeCrossing> crossings(Geographic start, Geographic end, const LineScale&) const;
  /// In order of the chains. O(points near the rectangle + chains / 32).
  std::vector<ShapePiece> pieces(const GeoRect&, const LineScale&) const;

 private:
  struct Block {
    std::uint32_t chain, first, last;  // segments first .. last - 1
    GeoRect box;
  };
  std::vector<ShapeChain> chains_;
  std::vector<ShapeExtent> networks_;
  std::vector<Block> blocks_;  // by chain, in order
};

}  // namespace tind
