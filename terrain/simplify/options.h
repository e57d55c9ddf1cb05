#pragma once
// What one simplification is asked for: a method with its own options, and what all methods read.

#include <variant>

#include "terrain/simplify/bounded/bounded.h"
#include "terrain/simplify/clustering/clustering.h"
#include "terrain/simplify/collapse/attribute_quadric.h"
#include "terrain/simplify/collapse/edge_cost.h"
#include "terrain/simplify/collapse/memoryless.h"
#include "terrain/simplify/collapse/quadric.h"
#include "terrain/simplify/collapse/triangle_collapse.h"
#include "terrain/simplify/collapse/vertex_removal.h"
#include "terrain/simplify/common/options.h"
#include "terrain/simplify/insertion/greedy_insertion.h"

namespace tind {

/// The alternative is the method, so no method can be given an option that it does not read. Each
/// alternative says
///   kName                  what the method is called
///   each_option(option)    calls option(name as it is typed, member, help) for each of its options
///   kVariant               the option that `tind compare` sets by "method:value", if there is one
///   kTellsCollapses        true where it heeds RunOptions::recorder
/// The first is the default: it has the fewest triangles within an error, and the smallest RMS at a
/// count (docs/methods.md).
using MethodOptions = std::variant<BoundedOptions, QemOptions, MemorylessOptions, GreedyOptions,
                                   ClusterOptions, AttributeQemOptions, EdgeCostOptions,
                                   TriangleCollapseOptions, VertexRemovalOptions>;

/// The default for general meshes, which `bounded` does not take.
using DefaultMeshMethod = QemOptions;

struct SimplifyOptions : RunOptions {
  MethodOptions method;
};

}  // namespace tind
