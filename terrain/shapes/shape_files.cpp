#include "terrain/shapes/shape_files.h"

namespace tind {

Result<void> set_shape_option(ShapeFiles& files, std::string_view name, std::string_view value) {
  if (name == "line_heights") {
    if (value != "line" && value != "dem")
      return fail(Errc::invalid_argument,
                  "line_heights takes line or dem, not \"" + std::string(value) + "\"");
    files.dem_heights = value == "dem";
    return {};
  }
  const std::pair<std::string_view, std::vector<std::string> ShapeFiles::*> kinds[] = {
      {"breaklines", &ShapeFiles::breaklines},
      {"flatten", &ShapeFiles::flatten},
      {"boundary", &ShapeFiles::boundary},
      {"water", &ShapeFiles::water}};
  for (const auto& [kind, member] : kinds) {
    if (name != kind) continue;
    if (value.empty())
      return fail(Errc::invalid_argument, std::string(name) + " takes the name of a file");
    (files.*member).emplace_back(value);
    return {};
  }
  return fail(Errc::invalid_argument, "no setting of lines is called \"" + std::string(name) +
                                          "\"; there are breaklines, flatten, boundary, water and "
                                          "line_heights");
}

}  // namespace tind
