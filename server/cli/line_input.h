#pragma once
// --breaklines, --flatten, --boundary: the options, reading them, and what is reported of them.

#include <CLI/App.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "terrain/simplify/constraints.h"

namespace tind::cli {

struct LineInput {
  std::vector<std::string> breaklines, flatten, boundary;  // files
  bool any() const { return !(breaklines.empty() && flatten.empty() && boundary.empty()); }
};

void add_line_options(CLI::App&, LineInput&);

/// The files' shapes over `grid`, which is all of `dem`.
Result<std::shared_ptr<const Constraints>> read_lines(const LineInput&, const DemSource& dem,
                                                      const HeightGrid& grid);

nlohmann::ordered_json lines_json(const ConstraintReport&, const ConstraintCheck&);
std::string lines_text(const ConstraintReport&, const ConstraintCheck&);

}  // namespace tind::cli
