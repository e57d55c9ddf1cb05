#pragma once
// Is this tile set what it says it is? Anyone's quantized-mesh tiles, in a directory or behind a
// URL, checked rule by rule (check_rules.h), between neighbours, against their layer.json and, when
// given, against their source.

#include <optional>
#include <string>
#include <vector>

#include "terrain/base/progress.h"
#include "terrain/base/result.h"
#include "terrain/check/check_findings.h"
#include "terrain/geo/tiling_scheme.h"
#include "terrain/surface/surface.h"

namespace tind {

struct CheckOptions {
  double error_factor = 1;                              // the budget that the tiles were built for
  int threads = 0;                                      // 0: one per core; eight for a URL
  int first_level = 0, last_level = tiling::kMaxLevel;  // what to look at
  std::optional<Surface> source = {};  // with it, max_error_m is recomputed over every post
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
  std::string source_note;  // source_note() of it, where there is one; posts only for violations
  bool ok() const {
    return findings.total(Severity::violation) == 0 && findings.total(Severity::unread) == 0;
  }
};

/// `where` is a directory, the URL of one, or that of a layer.json. Reads layer.json and every
/// tile, plain or gzipped. Streams: a few columns of one level are in memory at a time (with a
/// source also a cache of decoded tiles, at most about 256 MB). The report is the same for any
/// number of threads. Fails only when the tile set or its layer.json cannot be looked at or the
/// source cannot be read; whatever is wrong with the tiles is in the report.
Result<CheckReport> check_tiles(const std::string& where, const CheckOptions&,
                                const Progress& = {});

}  // namespace tind
