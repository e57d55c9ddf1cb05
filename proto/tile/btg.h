#pragma once
// BTG: FlightGear's scenery, one bucket a file, as SimGear's SGBinObject reads it. Little endian;
// what is stored is packed with gzip, which is not done here.

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "terrain/base/result.h"

namespace tind::proto {

struct Btg {
  std::array<double, 3> center{};                    // ECEF, metres
  float radius = 0;                                  // from there, of all vertices
  std::vector<std::array<float, 3>> vertices;        // less the centre
  std::vector<std::array<std::uint8_t, 3>> normals;  // ECEF, -1..1 as 0..255
  std::vector<std::array<float, 2>> texcoords;       // a unit is about 1000 m

  /// Places in the three lists above.
  struct Corner {
    std::uint32_t vertex = 0, normal = 0, texcoord = 0;
    friend bool operator==(const Corner&, const Corner&) = default;
  };
  struct Part {
    std::string material;                          // a name of FlightGear's materials
    std::vector<std::array<Corner, 3>> triangles;  // counter-clockwise
    friend bool operator==(const Part&, const Part&) = default;
  };
  std::vector<Part> parts;

  friend bool operator==(const Btg&, const Btg&) = default;
};

/// Version 7, whose numbers have two bytes; 10, with four, where some list is too long for that.
/// REQUIRES: materials shorter than 256 bytes; corners in range.
std::vector<std::uint8_t> encode(const Btg&);

/// What fgfs draws of a file of either version: triangles, with strips and fans cut into them. A
/// part without normals or texture coordinates of its own has the vertex's place for both, as
/// SimGear takes it. Points and what else there may be are left out. bad_data where lengths do not
/// fit or a corner names what is not there; needs at most some twenty times the memory of `bytes`.
Result<Btg> decode_btg(std::span<const std::uint8_t> bytes);

}  // namespace tind::proto
