#pragma once
// Is this tile set what it says it is? Anyone's quantized-mesh directory, checked rule by rule
// (check_rules.h), between neighbours, against its layer.json and, when given, against its source.

#include <optional>
#include <string>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/pyramid/check_findings.h"
#include "terrain/raster/dem_source.h"

namespace tind {

struct CheckOptions {
  double error_factor = 1;            // the budget that the tiles were built for
  int threads = 0;                    // 0: one per core
  const DemSource* source = nullptr;  // with it, max_error_m is recomputed over every post
};

struct CheckLevel {
  int level = 0;
  std::uint64_t tiles = 0, triangles = 0, bytes = 0;
  double stated_m = 0;    // largest max_error_m
  double measured_m = 0;  // largest error against the source
  double budget_m = 0;
  std::uint64_t posts = 0;  // post-tile pairs measured
  double crack_m = 0;       // largest difference between neighbours
  double gap_m = 0;         // largest difference to the level above along common edges
};

struct CheckReport {
  Findings findings;
  std::vector<CheckLevel> levels;
  bool ok() const { return findings.total(Severity::violation) == 0; }
};

/// Reads DIR/layer.json and every DIR/z/x/y.terrain, plain or gzipped. Streams: a few columns of
/// one level are in memory at a time (with a source also a cache of decoded tiles, at most about
/// 256 MB). The report is the same for any number of threads. Fails only when DIR cannot be looked
/// at or the source cannot be read; whatever is wrong with the tiles is in the report.
Result<CheckReport> check_tiles(const std::string& directory, const CheckOptions&,
                                const Progress& = {});

}  // namespace tind
