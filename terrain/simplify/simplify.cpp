// The table of methods, and the one place where options are checked before a method sees them.

#include "terrain/simplify/simplify.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "terrain/mesh/vertical_error.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/constraints/constraints.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/options.h"

namespace tind {

namespace {

using Method = Result<Simplified> (*)(const Terrain&, const MethodOptions&, const RunOptions&,
                                      const Progress&);

constexpr const char* kAlways = "0 flipped, 0 uncovered, lines stay edges";
constexpr const char* kAllStops = "triangles, ratio, max error";
constexpr const char* kHoles = "holes";
constexpr const char* kCovered = "covered";
constexpr const char* kNarrow = "narrow";

using OnHeldMesh = Result<std::uint64_t> (*)(HeldMesh&, const MethodOptions&, const Progress&);

struct Row {
  MethodInfo info;
  MethodOptions defaults;
  Method run;
  OnHeldMesh held;  // null where it does not collapse
};

template <class Options>
using Function = Result<Simplified>(const Terrain&, const Options&, const RunOptions&,
                                    const Progress&);

template <class Options>
Options options_of(Function<Options>*);

/// The function's own struct says the rest of the row: the name, and the names of its options.
template <auto function>
Row row(MethodInfo info) {
  using Options = decltype(options_of(function));
  info.name = Options::kName;
  Options::each_option([&](const char* name, auto, const char*) { info.options.push_back(name); });
  OnHeldMesh held = nullptr;
  if constexpr (requires(HeldMesh & mesh, const Options& o) {
                  collapse_held(mesh, o, Progress{});
                }) {
    info.tiles = true;
    held = [](HeldMesh& mesh, const MethodOptions& method, const Progress& progress) {
      return collapse_held(mesh, std::get<Options>(method), progress);
    };
  }
  return {std::move(info), Options{},
          [](const Terrain& dem, const MethodOptions& method, const RunOptions& options,
             const Progress& progress) {
            return function(dem, std::get<Options>(method), options, progress);
          },
          held};
}

const std::vector<Row>& table() {
  static const std::vector<Row> rows = {
      row<simplify_bounded>(
          {.minimises = "triangles within a strict vertical error, or squared error at a count",
           .stops = "triangles, ratio, max error above 0",
           .guarantees = kAlways,
           .source = "ours: floating heights",
           .take_for = "nearly everything: fewest triangles, least error",
           .voids_alone = kCovered,
           .time = "2",
           .rms = "0.6",
           .tiles = true}),
      row<simplify_qem>({.minimises = "squared distance to the planes of all merged triangles",
                         .stops = kAllStops,
                         .guarantees = kAlways,
                         .source = "Garland and Heckbert 1997",
                         .take_for = "voids that stay open; meshes (PLY, OBJ, STL)",
                         .voids_alone = kHoles,
                         .time = "1",
                         .rms = "1"}),
      row<simplify_memoryless>({.minimises = "squared volume between the current mesh and the next",
                                .stops = kAllStops,
                                .guarantees = kAlways,
                                .source = "Lindstrom and Turk 1998",
                                .take_for = "as qem, with less error",
                                .voids_alone = kHoles,
                                .time = "1.9",
                                .rms = "0.8"}),
      row<simplify_greedy>({.minimises = "the largest vertical error, vertices on posts",
                            .stops = kAllStops,
                            .guarantees = kAlways,
                            .source = "Garland and Heckbert 1995, greedy insertion",
                            .take_for = "vertices that are posts; haste",
                            .voids_alone = kCovered,
                            .time = "0.2",
                            .rms = "1.3",
                            .tiles = true}),
      row<simplify_cluster>(
          {.minimises = "squared distance to the planes of each cell of a uniform grid",
           .stops = "triangles, ratio; max error up to 33 million posts",
           .guarantees = kAlways,
           .source = "Rossignac and Borrel 1993; Lindstrom 2000",
           .take_for = "a DEM of any size in one pass; even triangles",
           .voids_alone = kNarrow,
           .time = "0.1",
           .rms = "2.4"}),
      row<simplify_attribute_qem>(
          {.minimises = "squared distance to planes of position, colour and normal (--drape)",
           .stops = kAllStops,
           .guarantees = kAlways,
           .source = "Han, Chun 2004; Min, Han, Chun: EQEM",
           .take_for = "colour, texture and shading that are to survive",
           .voids_alone = kHoles,
           .time = "2.4",
           .rms = "1.4"}),
      row<simplify_edge_cost>(
          {.minimises = "edge length x circumradius, height difference and degree",
           .stops = kAllStops,
           .guarantees = kAlways,
           .source = "Kim, Yu, Park, Cho: a terrain edge cost",
           .take_for = "even triangles; the paper's figures",
           .voids_alone = kHoles,
           .time = "0.8",
           .rms = "3.4"}),
      row<simplify_triangle_collapse>(
          {.minimises = "squared distance to planes, six triangles a step",
           .stops = kAllStops,
           .guarantees = kAlways,
           .source = "Sung and Park: PMTC; Gieng et al. 1997",
           .take_for = "progressive meshes of few steps",
           .voids_alone = kHoles,
           .time = "0.7",
           .rms = "1.3"}),
      row<simplify_vertex_removal>(
          {.minimises = "distance to the ring's average plane, or the degree",
           .stops = kAllStops,
           .guarantees = kAlways,
           .source = "Schroeder, Zarge, Lorensen 1992",
           .take_for = "a baseline; vertices that are posts",
           .voids_alone = kHoles,
           .time = "1.5",
           .rms = "5.5"}),
  };
  return rows;
}

std::string names() {
  std::string all;
  for (const Row& row : table()) all += (all.empty() ? "" : ", ") + row.info.name;
  return all;
}

std::unexpected<Error> no_such_method(const std::string& name) {
  return fail(Errc::invalid_argument, "there is no method '" + name + "'; there are " + names());
}

const Row& row_of(const MethodOptions& method) {
  return *std::ranges::find(table(), method.index(),
                            [](const Row& r) { return r.defaults.index(); });
}

/// Sets the option that kVariant names.
template <class Options>
Result<void> set_variant(Options& options, const std::string& value) {
  if constexpr (requires { Options::kVariant; }) {
    Result<void> done;
    Options::each_option([&](const std::string& name, auto member, const char*) {
      using Field = std::remove_reference_t<decltype(options.*member)>;
      if constexpr (NamedEnum<Field>) {
        if (name != Options::kVariant) return;
        const auto parsed = parse_enum<Field>(value);
        if (parsed)
          options.*member = *parsed;
        else
          done = std::unexpected(parsed.error());
      }
    });
    return done;
  } else {
    return no_such_method(Options::kName + (":" + value));
  }
}

/// What only lines need: their grid, polygons level to the last bit, and a word where heights that
/// the lines bring cannot be had together with the error bound.
Result<Simplified> with_lines(const Row& row, const SimplifyOptions& options,
                              const Progress& progress) {
  const Constraints& constraints = *options.constraints;
  Result<Simplified> made = row.run(constraints.dem, options.method, options, progress);
  if (!made) return made;
  set_level(made->tin, constraints);
  if (options.stop.max_error_m &&
      vertical_error(made->tin, constraints.dem.grid, options.threads).max_m >
          *options.stop.max_error_m) {
    made->note =
        "the bound is not held everywhere: the lines themselves, or posts beside them, are farther "
        "from the DEM";
  }
  return made;
}

}  // namespace

std::span<const MethodInfo> methods() {
  static const std::vector<MethodInfo> infos = [] {
    std::vector<MethodInfo> all;
    for (const Row& row : table()) all.push_back(row.info);
    return all;
  }();
  return infos;
}

std::vector<MethodOptions> all_methods() {
  std::vector<MethodOptions> all;
  for (const Row& row : table()) all.push_back(row.defaults);
  return all;
}

std::string method_name(const MethodOptions& method) {
  return std::visit([](const auto& options) { return std::string(options.kName); }, method);
}

const MethodInfo& info_of(const MethodOptions& method) { return row_of(method).info; }

Result<MethodOptions> method_named(const std::string& name) {
  for (const Row& row : table())
    if (row.info.name == name) return row.defaults;
  return no_such_method(name);
}

Result<void> check_options(const MethodOptions& method) {
  return std::visit(
      [](const auto& options) -> Result<void> {
        if constexpr (requires { check_method(options); }) return check_method(options);
        return {};
      },
      method);
}

Result<std::uint64_t> simplify_held(HeldMesh& mesh, const MethodOptions& method,
                                    const Progress& progress) {
  const Row& row = row_of(method);
  if (row.held) return row.held(mesh, method, progress);
  return fail(Errc::unsupported, row.info.name + " collapses no edges");
}

Result<MethodOptions> method_variant(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return method_named(text);
  Result<MethodOptions> method = method_named(text.substr(0, colon));
  if (!method) return method;
  const Result<void> set = std::visit(
      [&](auto& options) { return set_variant(options, text.substr(colon + 1)); }, *method);
  if (!set) return std::unexpected(set.error());
  return method;
}

Result<Simplified> simplify(const Terrain& dem, const SimplifyOptions& options,
                            const Progress& progress) {
  const Row& row = row_of(options.method);
  if (const Result<void> ok = check_stop(options.stop); !ok) return std::unexpected(ok.error());
  if (!(dem.spacing_x_m > 0 && dem.spacing_y_m > 0 &&
        std::isfinite(dem.spacing_x_m * dem.spacing_y_m)))
    return fail(Errc::invalid_argument, "the post spacing must be positive");
  const HeightGrid& grid = dem.grid;
  if (grid.cols() < 2 || grid.rows() < 2) {
    return fail(Errc::bad_data, "a grid of " + std::to_string(grid.cols()) + " x " +
                                    std::to_string(grid.rows()) +
                                    " posts has no triangles; at least 2 x 2 are needed");
  }
  if (options.constraints) return with_lines(row, options, progress);
  return row.run(dem, options.method, options, progress);
}

}  // namespace tind
