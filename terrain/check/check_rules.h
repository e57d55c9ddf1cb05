#pragma once
// Every rule that `tind check` knows, as data: a name, how bad it is, and what it demands.
// docs/formats.md explains each with its reason.

#include <array>
#include <cstddef>
#include <string_view>

namespace tind {

enum class Severity {
  violation,  // some client shows it wrong, or a promise is broken
  warning,    // works today, but is careless or slow
  unread,     // the disk or the server failed just now: nothing is said of what it is
};

struct CheckRule {
  std::string_view id;
  Severity severity;
  std::string_view demands;
};

inline constexpr auto kViolation = Severity::violation;
inline constexpr auto kWarning = Severity::warning;
inline constexpr auto kUnread = Severity::unread;

inline constexpr CheckRule kCheckRules[] = {
    // layer.json
    {"layer.readable", kViolation, "layer.json is there and is a JSON object"},
    {"layer.format", kViolation, "format is quantized-mesh-1.0"},
    {"layer.tiles", kViolation, "tiles holds at least one template with {z}, {x} and {y}"},
    {"layer.version", kViolation, "version is a string"},
    {"layer.projection", kViolation, "projection is EPSG:4326"},
    {"layer.scheme", kViolation, "scheme is tms"},
    {"layer.bounds", kViolation, "bounds are west < east, south < north, in degrees"},
    {"layer.available", kViolation, "available lists ranges of tiles by level from 0"},
    {"layer.range", kViolation, "ranges of available lie inside the pyramid, start <= end"},
    {"layer.roots", kViolation, "level 0 lists both root tiles"},
    {"layer.maxzoom", kViolation, "maxzoom is the deepest level of available"},
    {"layer.minzoom", kViolation, "minzoom is a level that is not below maxzoom"},
    {"layer.extensions", kWarning, "extensions names what the tiles carry"},
    {"layer.attribution", kWarning, "attribution is a string"},
    // what is there
    {"available.missing", kViolation, "every tile of available is there"},
    {"available.unlisted", kViolation, "every tile that is there is in available"},
    {"available.orphan", kViolation, "a tile's parent is there"},
    {"available.stray", kWarning, "no .terrain files outside z/x/y"},
    // bytes of a tile
    {"tile.readable", kViolation, "it is a file, or whole in its archive"},
    {"tile.unread", kUnread, "disk and server gave its bytes when they were asked for"},
    {"tile.gzip", kViolation, "gzip data is whole"},
    {"tile.ledger", kViolation, "size and hash are those of tind's ledger, where one is there"},
    {"build.blocks", kViolation, "the blocks that tind's record names are there, and whole"},
    {"tile.truncated", kViolation, "the tile ends where its counts say"},
    {"tile.trailing", kViolation, "nothing follows the last extension"},
    {"tile.padding", kViolation, "two bytes before 32-bit indices of an odd number of vertices"},
    {"tile.index-width", kViolation, "indices have 32 bits iff there are more than 65536 vertices"},
    {"tile.empty", kViolation, "at least 4 vertices and 2 triangles"},
    {"tile.header", kViolation, "every number of the header is finite"},
    {"tile.quantised", kViolation, "u, v and height lie in 0..32767"},
    {"tile.index", kViolation, "high-water-mark codes name vertices that are there"},
    {"tile.unused", kWarning, "every vertex is used by a triangle"},
    // extensions
    {"ext.big-endian", kViolation, "extension lengths are little endian"},
    {"ext.unknown", kWarning, "only extensions 1, 2 and 4"},
    {"ext.duplicate", kViolation, "an extension comes once"},
    {"ext.normals", kViolation, "two bytes of normal per vertex"},
    {"ext.water-mask", kViolation, "a water mask has 1 or 65536 bytes"},
    {"ext.metadata", kViolation, "metadata is a length and a JSON object"},
    // heights
    {"height.range", kViolation, "minimum height <= maximum height"},
    {"height.plausible", kWarning, "vertices lie between -12 and 10 km"},
    // edges
    {"edge.short", kViolation, "an edge list names at least two vertices"},
    {"edge.index", kViolation, "edge lists name vertices that are there"},
    {"edge.off", kViolation,
     "edge lists name only vertices on their side (W S E N; v = 0 is south)"},
    {"edge.missing", kViolation, "edge lists name every vertex on their side"},
    {"edge.corner", kViolation, "edge lists name both corners"},
    {"edge.duplicate", kViolation, "edge lists name a vertex once"},
    {"edge.order", kWarning, "edge lists go around: W north, S west, E south, N east"},
    // the mesh seen from above
    {"mesh.corners", kViolation, "there is a vertex in each corner of the tile's rectangle"},
    {"mesh.orientation", kViolation, "triangles are counter-clockwise"},
    {"mesh.degenerate", kViolation, "triangles have an area (no skirts, no collapsed ones)"},
    {"mesh.manifold", kViolation, "an edge is used once in each direction"},
    {"mesh.cover", kViolation, "triangles cover the rectangle exactly once"},
    // culling
    {"sphere.contains", kViolation, "the bounding sphere contains every vertex"},
    {"sphere.loose", kWarning, "the bounding sphere is at most twice as large as needed"},
    {"center.inside", kViolation, "the centre is near the middle of the tile"},
    {"horizon.scaled", kViolation, "the occlusion point is in ellipsoid-scaled space, not metres"},
    {"horizon.hides", kViolation, "the occlusion point never hides a vertex that can be seen"},
    {"horizon.depth", kWarning, "nor with the ellipsoid lowered to heights below zero"},
    {"horizon.far", kWarning, "the occlusion point is no farther than the tile needs"},
    // normals
    {"normal.down", kViolation, "normals point up"},
    // errors
    {"error.missing", kWarning, "metadata says max_error_m"},
    {"error.value", kViolation, "max_error_m is a number >= 0"},
    {"error.geometric", kViolation, "geometricerror is not below max_error_m"},
    {"error.refines", kViolation, "geometricerror is above the children's, stated or assumed"},
    {"error.budget", kViolation, "max_error_m is within what clients assume of the level"},
    {"error.side", kViolation, "side is both, above or below"},
    {"error.edge", kViolation, "edge_error_m is a number >= 0"},
    {"error.edge-large", kWarning,
     "edge_error_m is within four times what clients assume of the level"},
    // neighbours
    {"crack.position", kViolation, "neighbours decode to the same shared edge, bit by bit"},
    {"crack.normal", kViolation, "neighbours have the same normals on their shared edge"},
    {"crack.level", kWarning, "the gap to the next level is within both errors together"},
    {"crack.stated", kViolation, "the gap to the next level is within both edge_error_m together"},
    {"crack.stand-in", kWarning,
     "where a neighbour is missing, the gap to the part of its parent is within both errors"},
    // against the source
    {"source.error", kViolation, "no post is farther from the mesh than max_error_m"},
    {"source.side", kViolation,
     "no post is above a mesh of side above, none below one of side below"},
    {"source.exact", kViolation, "an error that is called exact is the maximum over all posts"},
    {"source.height", kViolation, "minimum and maximum height bound the posts of the tile"},
    {"source.flat", kViolation, "polygons that are to be level are, well inside"},
    {"source.water", kViolation, "the water mask shows the water of the source, cell by cell"},
    {"source.overlap", kViolation, "the source has posts where the tiles are"},
    {"source.missing", kViolation, "every post of the source lies in a tile"},
    {"source.sparse", kWarning, "a level that has tiles has one for every post of a DEM"},
};

inline constexpr std::size_t kCheckRuleCount = std::size(kCheckRules);

/// The place of a rule in the table; an unknown name does not compile.
consteval std::size_t rule(std::string_view id) {
  for (std::size_t i = 0; i < kCheckRuleCount; ++i)
    if (kCheckRules[i].id == id) return i;
  throw "no such rule";
}

}  // namespace tind
