#pragma once
// How the tiles of a store were made: what a build notes beside them, and goes by when it is run
// again.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tind {

/// Everything that the bytes of the tiles depend on.
struct BuildRecord {
  int epoch = 0;            // of the program: others make other bytes of the same posts
  std::string grid;         // digest of where the posts are and what their heights mean
  std::string heights;      // digest of the heights
  double max_error_m = 0;   // at the leaves
  double error_factor = 0;  // of the budgets of all levels; 0 where the record does not say
  int deepest_level = -1;   // where the pyramid ends
  int first_level = 0, last_level = -1;  // those that were made
  std::string side = "both";
  std::string vertical_datum;
  std::string effort;
  std::string method;            // with its options; empty: bounded
  bool gzip = false;             // the tiles are stored compressed
  std::int64_t exact_posts = 0;  // 0: not asked for
  std::string tiles;             // digest of which tiles there are; empty: rectangles
  std::vector<double> steps_m;   // by level: the step of heights on borders
  std::string shapes;            // stands for the lines and the water; empty: there are none
  std::string shape_levels;      // and this for their levels, which go by the heights
};

/// The text that is kept: the same record, the same text.
std::string encode(const BuildRecord&);

/// Whatever the text says of it: what is missing or of another kind stays as it is by default.
/// Nothing where it is not a JSON object. Says nothing about who wrote it.
std::optional<BuildRecord> decode_build_record(std::string_view text);

}  // namespace tind
