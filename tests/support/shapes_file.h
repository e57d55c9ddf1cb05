#pragma once
// Polygons and lines in a GeoJSON file that goes with its object.

#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "terrain/geo/coordinates.h"

namespace tind::test {

/// Polygons as GeoJSON; each ring closes by itself. `z`: a height for every vertex.
class ShapesFile {
 public:
  explicit ShapesFile(const std::string& name)
      : path_((std::filesystem::temp_directory_path() /
               ("tind-shapes-" + std::to_string(::getpid()) + "-" + name + ".geojson"))
                  .string()) {}
  ~ShapesFile() { std::filesystem::remove(path_); }

  ShapesFile& polygon(const std::vector<std::vector<Vec2>>& rings, std::optional<double> z = {}) {
    return feature("Polygon", rings, z, true);
  }
  ShapesFile& line(const std::vector<Vec2>& points, std::optional<double> z = {}) {
    std::string text;
    add(text, points, z, false);
    features_.push_back("{\"type\":\"LineString\",\"coordinates\":" + text + "}");
    return *this;
  }
  const std::string& write() const {
    std::ofstream out(path_);
    out << "{\"type\":\"FeatureCollection\",\"features\":[";
    for (std::size_t k = 0; k < features_.size(); ++k)
      out << (k ? "," : "")
          << "{\"type\":\"Feature\",\"properties\":{},\"geometry\":" << features_[k] << "}";
    out << "]}";
    return path_;
  }

 private:
  std::string path_;
  std::vector<std::string> features_;

  static void add(std::string& text, const std::vector<Vec2>& points, std::optional<double> z,
                  bool close) {
    text += "[";
    for (std::size_t k = 0; k < points.size() + close; ++k) {
      const Vec2& p = points[k % points.size()];
      char buffer[120];
      if (z)
        std::snprintf(buffer, sizeof buffer, "%s[%.17g,%.17g,%.17g]", k ? "," : "", p.x, p.y, *z);
      else
        std::snprintf(buffer, sizeof buffer, "%s[%.17g,%.17g]", k ? "," : "", p.x, p.y);
      text += buffer;
    }
    text += "]";
  }
  ShapesFile& feature(const char* type, const std::vector<std::vector<Vec2>>& rings,
                      std::optional<double> z, bool close) {
    std::string text = "[";
    for (std::size_t k = 0; k < rings.size(); ++k) {
      if (k) text += ",";
      add(text, rings[k], z, close);
    }
    features_.push_back(std::string("{\"type\":\"") + type + "\",\"coordinates\":" + text + "]}");
    return *this;
  }
};

inline std::vector<Vec2> square(double west, double south, double side) {
  return {{west, south}, {west + side, south}, {west + side, south + side}, {west, south + side}};
}

}  // namespace tind::test
