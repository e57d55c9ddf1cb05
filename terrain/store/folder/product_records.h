#pragma once
// The files by which a folder says what tind wrote there other than tiles: it holds one thing, as
// servers take it for one.

namespace tind {

inline constexpr const char* kImagesRecord = "/tind-images.json";      // terrain/images
inline constexpr const char* kSceneryRecord = "/tind-flightgear.txt";  // terrain/flightgear
inline constexpr const char* kCdbRecord = "/tind-cdb.txt";             // terrain/heightmaps

}  // namespace tind
