#include "terrain/simplify/bounded/search_effort.h"

namespace tind {

namespace {

struct Row {
  Effort effort;
  SearchEffort mesh, tile;  // reach, rounds, move_tries, step_gain
};

constexpr Row kRows[] = {
    {Effort::fast, {0.1, 0, 0, 0}, {0.1, 0, 0, 0}},
    {Effort::normal, {1, 1, 6, 0.1}, {1, 0, 0, 0}},
    {Effort::best, {3, 5, 12, 0}, {3, 7, 12, 0}},
};

const Row& row_of(Effort effort) {
  for (const Row& row : kRows)
    if (row.effort == effort) return row;
  return kRows[1];
}

}  // namespace

SearchEffort mesh_effort(Effort effort) { return row_of(effort).mesh; }

SearchEffort tile_effort(Effort effort) { return row_of(effort).tile; }

void set_effort(const SearchEffort& effort, MesherOptions& options) {
  options.search_reach = effort.reach;
  options.rounds = effort.rounds;
  options.flips = effort.rounds > 1;
  options.move_tries = effort.move_tries;
  options.step_gain = effort.step_gain;
}

}  // namespace tind
