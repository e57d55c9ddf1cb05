// tind compare: several methods on one DEM, one table.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/commands/meshes/compare_tiles.h"
#include "server/cli/options/dem_input.h"
#include "server/cli/options/drape_input.h"
#include "server/cli/options/line_input.h"
#include "server/cli/options/mesh_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/tile_options.h"
#include "server/cli/pictures/compare_page.h"
#include "server/cli/pictures/surface_report.h"
#include "server/cli/program/progress_bar.h"
#include "server/cli/program/run_apart.h"
#include "terrain/base/file_io.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/raster/height_rounding.h"
#include "terrain/simplify/common/simplified.h"
#include "terrain/simplify/constraints/voids.h"
#include "terrain/simplify/method_text.h"
#include "terrain/simplify/methods.h"
#include "terrain/simplify/options.h"
#include "terrain/simplify/rounded_posts.h"
#include "terrain/simplify/simplify.h"
#include "terrain/simplify/simplify_tin.h"

namespace tind::cli {

namespace {

struct Arguments {
  DemInput input;
  LineInput lines;
  std::vector<std::string> methods = {"bounded", "memoryless", "qem", "greedy", "cluster"};
  std::vector<std::string> at, max_error;
  std::string html, csv, report, title, drape, progress = "auto";
  int threads = 1;
  bool json = false;
  bool tiles = false;      // by several methods, instead of one mesh by each
  TileSetOptions pyramid;  // of theirs, but for the method
};

Result<double> parse_number(const std::string& text) {
  char* end = nullptr;
  const double v = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(v))
    return fail(Errc::invalid_argument, "'" + text + "' is not a number");
  return v;
}

/// "10%": a ratio; "5000": a count.
Result<StopAt> parse_at(const std::string& text) {
  StopAt stop;
  const bool share = text.ends_with('%');
  const auto v = parse_number(share ? text.substr(0, text.size() - 1) : text);
  if (!v) return std::unexpected(v.error());
  if (share)
    stop.ratio = *v / 100;
  else if (*v >= 1 && *v <= 1e12)
    stop.triangles = std::uint64_t(*v);
  else
    return fail(Errc::invalid_argument,
                "'" + text + "': give a count of triangles or a share like 10%");
  return stop;
}

/// What is compared on: makes a mesh, and fills a row's figures of it.
struct Subject {
  std::function<Result<Simplified>(const SimplifyOptions&)> make;
  std::function<void(const SimplifyOptions&, CompareRow&)> measure;
  nlohmann::ordered_json (*figures)(const MeshQuality&);
};

/// "qem", "vertex-removal:degree", or with any options: "edge-cost alpha=0.5 placement=fit".
Result<MethodOptions> method_of_text(const std::string& text) {
  return text.find(' ') == text.npos ? method_variant(text) : method_from_text(text);
}

CompareRow run_one(const Subject& subject, const std::string& method, const std::string& stop_text,
                   const SimplifyOptions& options) {
  CompareRow row;
  row.method = method;
  row.stop = stop_text;
  MeasuredRun run = run_apart([&] { return subject.make(options); });
  row.seconds = run.seconds;
  row.cpu_seconds = run.cpu_seconds;
  row.peak_mb = run.peak_mb;
  row.page_faults = run.page_faults;
  Result<Simplified>& made = run.made;
  if (!made) {
    row.failure = made.error().what;
    return row;
  }
  row.made = std::move(*made);
  subject.measure(options, row);
  return row;
}

nlohmann::ordered_json row_json(const CompareRow& r, const Subject& subject) {
  nlohmann::ordered_json j = {{"method", r.method}, {"stop", r.stop}};
  if (!r.failure.empty()) {
    j["failure"] = r.failure;
    return j;
  }
  j["steps"] = r.made.steps;
  j["input_triangles"] = r.made.input_triangles;
  j.update(subject.figures(r.quality));
  j["seconds"] = r.seconds;
  j["cpu_seconds"] = r.cpu_seconds;
  j["peak_mb"] = r.peak_mb;
  j["page_faults"] = r.page_faults;
  if (r.attributes) j["surface"] = distance_json(*r.attributes);
  j["note"] = r.made.note;
  return j;
}

/// A second table, of the rows that carry attributes.
std::string attributes_text(const std::vector<CompareRow>& rows) {
  std::string out;
  const auto cell = [](const std::optional<AttributeError>& e) {
    return e ? fmt::format("{:>10.4f} {:>10.4f}", e->rms, e->max) : fmt::format("{:>21}", "-");
  };
  for (const CompareRow& r : rows) {
    if (!r.attributes) continue;
    if (out.empty())
      out = fmt::format("\n{:<26} {:>8} {:>10} {:>10} {:>10} {:>10}\n", "attributes of", "stop",
                        "colour rms", "max", "normal rms", "max");
    out += fmt::format("{:<26} {:>8} {} {}\n", r.method, r.stop, cell(r.attributes->colour),
                       cell(r.attributes->normal));
  }
  return out;
}

std::string table_text(const std::vector<CompareRow>& rows) {
  std::string out = fmt::format(
      "{:<26} {:>8} {:>10} {:>9} {:>9} {:>9} {:>9} {:>8} {:>10} {:>8} {:>8}\n", "method", "stop",
      "triangles", "steps", "rms m", "max m", "p99 m", "flipped", "uncovered", "time s", "peak MB");
  for (const CompareRow& r : rows) {
    if (!r.failure.empty()) {
      out += fmt::format("{:<26} {:>8} {}\n", r.method, r.stop, r.failure);
      continue;
    }
    const VerticalError& e = r.quality.error;
    out += fmt::format(
        "{:<26} {:>8} {:>10} {:>9} {:>9.3f} {:>9.2f} {:>9.2f} {:>8} {:>10} {:>8.3f} {:>8.0f}\n",
        r.method, r.stop, r.quality.triangles, r.made.steps, e.rms_m, e.max_m, e.p99_m,
        r.quality.flipped, r.quality.uncovered, r.seconds, r.peak_mb);
  }
  return out + attributes_text(rows);
}

std::string table_csv(const std::vector<CompareRow>& rows) {
  std::string out =
      "method,stop,triangles,steps,rms_m,max_m,p95_m,p99_m,flipped,uncovered,seconds,peak_mb,"
      "colour_rms,colour_max,normal_rms,normal_max\n";
  const auto cells = [](const std::optional<AttributeError>& e) {
    return e ? fmt::format("{},{}", e->rms, e->max) : std::string(",");
  };
  for (const CompareRow& r : rows) {
    if (!r.failure.empty()) continue;
    const VerticalError& e = r.quality.error;
    const SurfaceDistance attributes = r.attributes.value_or(SurfaceDistance{});
    out += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", r.method, r.stop,
                       r.quality.triangles, r.made.steps, e.rms_m, e.max_m, e.p95_m, e.p99_m,
                       r.quality.flipped, r.quality.uncovered, r.seconds, r.peak_mb,
                       cells(attributes.colour), cells(attributes.normal));
  }
  return out;
}

Result<std::vector<std::pair<std::string, StopAt>>> stops_of(const Arguments& a) {
  std::vector<std::pair<std::string, StopAt>> stops;
  for (const std::string& text : a.at) {
    const auto stop = parse_at(text);
    if (!stop) return std::unexpected(stop.error());
    stops.push_back({text, *stop});
  }
  for (const std::string& text : a.max_error) {
    const auto v = parse_number(text);
    if (!v) return std::unexpected(v.error());
    StopAt stop;
    stop.max_error_m = *v;
    stops.push_back({text + " m", stop});
  }
  return stops;
}

/// A row for each method at each stop.
std::vector<CompareRow> rows_of(const Arguments& a, const Subject& subject,
                                const std::vector<MethodOptions>& chosen,
                                const std::vector<std::pair<std::string, StopAt>>& stops,
                                SimplifyOptions options) {
  std::vector<CompareRow> rows;
  ProgressBar bar("compare", progress_style(a.progress));
  for (const auto& [text, stop] : stops) {
    options.stop = stop;
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      options.method = chosen[i];
      rows.push_back(run_one(subject, a.methods[i], text, options));
      bar.at(double(rows.size()) / double(stops.size() * chosen.size()));
    }
  }
  return rows;
}

/// `head`: what the report says before the table.
Result<void> put_table(const Arguments& a, const std::vector<CompareRow>& rows,
                       const Subject& subject, nlohmann::ordered_json head) {
  nlohmann::ordered_json table = nlohmann::ordered_json::array();
  for (const CompareRow& r : rows) table.push_back(row_json(r, subject));
  if (a.json)
    std::printf("%s\n", json::to_text(table, 2).c_str());
  else
    fmt::print("{}", table_text(rows));
  if (!a.report.empty()) {
    head["table"] = std::move(table);
    if (auto ok = write_whole_file(a.report, json::to_text(head, 2) + "\n"); !ok) return ok;
  }
  return a.csv.empty() ? Result<void>() : write_whole_file(a.csv, table_csv(rows));
}

/// The last word on a table.
int verdict(const std::vector<CompareRow>& rows) {
  if (std::ranges::any_of(rows, [](const CompareRow& r) { return r.failure.empty(); })) return kOk;
  return complain({Errc::invalid_argument, "no method gave a result"});
}

/// Terrain that is a mesh already.
int run_tin(const Arguments& a, const std::vector<MethodOptions>& chosen,
            const std::vector<std::pair<std::string, StopAt>>& stops) {
  const std::string& path = a.input.files[0];
  if (a.input.files.size() != 1) return complain({Errc::invalid_argument, "one mesh at a time"});
  if (const auto ok = no_dem_options(a.input, path); !ok) return complain(ok.error());
  if (a.lines.any() || !a.drape.empty() || !a.html.empty())
    return complain({Errc::invalid_argument, "lines, --drape and --html need a DEM, not a mesh"});
  const auto read = read_terrain_tin(path);
  if (!read) return complain(read.error());
  const TerrainTin& terrain = read->terrain;
  const Subject subject = {[&](const SimplifyOptions& o) { return simplify_tin(terrain, o); },
                           [&](const SimplifyOptions& o, CompareRow& row) {
                             row.quality = tin_quality(row.made.tin, terrain, o.threads);
                           },
                           tin_quality_json};
  SimplifyOptions options;
  options.threads = a.threads;
  const auto rows = rows_of(a, subject, chosen, stops, options);
  const nlohmann::ordered_json head = {{"input", a.input.files},
                                       {"input_triangles", terrain.tin.triangles.size()}};
  if (const auto ok = put_table(a, rows, subject, head); !ok) return complain(ok.error());
  return verdict(rows);
}

int run(const Arguments& a) {
  std::vector<MethodOptions> chosen;
  for (const std::string& text : a.methods) {
    const auto method = method_of_text(text);
    if (!method) return complain(method.error());
    chosen.push_back(*method);
  }
  const auto stops = stops_of(a);
  if (!stops) return complain(stops.error());
  std::vector<std::string> inputs = inputs_of(a.input, a.lines);
  inputs.push_back(a.drape);
  if (const int code = check_outputs({a.csv, a.html, a.report}, inputs); code != kOk) return code;
  if (is_mesh(a.input.files[0])) return run_tin(a, chosen, *stops);
  const auto takes_drape = [](const MethodOptions& m) {
    return std::holds_alternative<AttributeQemOptions>(m);
  };
  if (!a.drape.empty() && std::ranges::none_of(chosen, takes_drape))
    return complain(
        {Errc::invalid_argument, "--drape is for attribute-qem, which is not compared"});
  const auto dem = open_dem(a.input);
  if (!dem) return complain(dem.error());
  const DemInfo& info = (*dem)->info();
  auto posts = read_all(**dem);
  if (!posts) return complain(posts.error());
  // Voids are covered, as `simplify` has it: filled for methods that would leave them open.
  Terrain filled;
  SimplifyOptions options, of_filled;
  const bool fills = has_voids(posts->grid);
  if (fills) filled = {covered(posts->grid), posts->spacing_x_m, posts->spacing_y_m};
  if (a.lines.any()) {
    const auto take = [&](Terrain& terrain, SimplifyOptions& o) -> Result<void> {
      auto constraints = read_lines(a.lines, **dem, terrain);
      if (!constraints) return std::unexpected(constraints.error());
      o.constraints = std::move(*constraints);
      terrain = o.constraints->dem;
      return {};
    };
    if (const auto ok = take(*posts, options); !ok) return complain(ok.error());
    if (fills)
      if (const auto ok = take(filled, of_filled); !ok) return complain(ok.error());
  }
  const double rounding = height_rounding(info, posts->grid);
  const auto simplified = [&](SimplifyOptions o) {
    const bool alone = !fills || info_of(o.method).voids_alone == "covered";
    const SimplifyOptions asked = o;
    o.stop = within_rounding(asked, rounding);
    if (!alone) o.constraints = of_filled.constraints;
    auto made = simplify(alone ? *posts : filled, o);
    if (made) keep_side(asked, rounding, made->tin);
    return made;
  };
  options.threads = a.threads;
  if (!a.drape.empty()) {
    const auto colours = drape_posts(a.drape, **dem);
    if (!colours) return complain(colours.error());
    for (MethodOptions& method : chosen)
      if (auto* const attributed = std::get_if<AttributeQemOptions>(&method))
        attributed->drape = *colours;
  }
  const Subject subject = {simplified,
                           [&](const SimplifyOptions& o, CompareRow& row) {
                             row.quality =
                                 mesh_quality(row.made.tin, MeshMap{}, posts->grid, o.threads);
                             widen(row.quality, rounding);
                             row.attributes = attribute_errors(o, *posts, row.made.tin);
                           },
                           quality_json};
  const auto rows = rows_of(a, subject, chosen, *stops, options);
  const nlohmann::ordered_json head = {
      {"input", info.files}, {"columns", posts->grid.cols()}, {"rows", posts->grid.rows()}};
  if (const auto ok = put_table(a, rows, subject, head); !ok) return complain(ok.error());
  const std::string title =
      a.title.empty() ? "Simplifying " + info.files[0].substr(info.files[0].rfind('/') + 1)
                      : a.title;
  if (!a.html.empty())
    if (const auto ok = write_whole_file(a.html, compare_page(title, rows, *posts)); !ok)
      return complain(ok.error());
  return verdict(rows);
}

/// What of the line makes no sense beside --tiles; empty: nothing.
std::string out_of_place(Command app, const Arguments& a) {
  for (const char* option : {"--at", "--drape", "--html", "--title", "--csv", "--report"})
    if (app.given(option)) return std::string(option) + " is for meshes; leave it or --tiles out";
  if (a.lines.any()) return "tiles are compared without lines";
  if (a.max_error.size() > 1)
    return "a pyramid has one --max-error, that of its deepest level; give one, or none";
  return {};
}

int run_tiles(Command app, const Arguments& a) {
  if (const std::string wrong = out_of_place(app, a); !wrong.empty())
    return complain({Errc::invalid_argument, wrong});
  CompareTiles c;
  c.input = a.input;
  if (!a.input.to_datum_given) c.input.to_datum = "ellipsoid";  // as tind build has it
  c.threads = a.threads;
  c.json = a.json;
  TileSetOptions options = a.pyramid;
  for (const std::string& text : a.max_error) {
    const auto v = parse_number(text);
    if (!v) return complain(v.error());
    options.max_error_m = *v;
  }
  const std::vector<std::string> usual = {"bounded", "memoryless", "qem", "greedy", "edge-cost"};
  for (const std::string& text : app.given("--methods") ? a.methods : usual) {
    const auto method = method_of_text(text);
    if (!method) return complain(method.error());
    options.method = *method;
    const auto* const bounded = std::get_if<BoundedOptions>(&*method);
    options.effort = bounded ? bounded->effort : Effort::normal;
    c.methods.emplace_back(text, options);
  }
  return compare_tiles(c);
}

}  // namespace

void add_compare(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app = program.add_subcommand(
      "compare",
      "Run several methods on one DEM or TIN and print one table of size, error and time");
  app.add_option(
         "input", a->input.files,
         "a DEM, or several that share one grid; or terrain as a mesh: " + readable_extensions())
      .required();
  app.add_option("--methods", a->methods,
                 "names, comma-separated; name:variant picks a criterion (vertex-removal), a "
                 "placement (triangle-collapse), a metric (attribute-qem) or an effort (bounded); "
                 "'name option=value' sets any option; of a mesh all but cluster")
      .delimiter(',')
      .shown();
  app.add_flag(
      "--tiles", a->tiles,
      "compare the tiles of the DEM's pyramid, each of which keeps the error that its level "
      "may have: bytes, triangles, time and largest error by method and level");
  add_levels_option(app, "--tiles: only these levels of the pyramid, e.g. 0-8 (default: all)",
                    a->pyramid.first_level, a->pyramid.last_level);
  Command stop = app.add_group("Stop at (exactly one; with --tiles --max-error at most)", 0, 1);
  stop.add_option("--at", a->at, "shares like 10% or triangle counts, comma-separated")
      .delimiter(',');
  stop.add_option("--max-error", a->max_error,
                  "error bounds in metres, comma-separated; --tiles: that of the deepest level "
                  "(default: 1/32 of the posts' spacing)")
      .delimiter(',');
  add_dem_options(app, a->input);
  add_window_options(app, a->input);
  add_line_options(app, a->lines);
  app.add_option("--drape", a->drape, "attribute-qem: colours from this image");
  app.add_option("--html", a->html, "write a page with curves and pictures, which stands alone");
  app.add_option("--title", a->title, "of the page, in place of the DEM's name");
  app.add_option("--csv", a->csv, "write the table here as CSV");
  app.add_option("--report", a->report, "write the table here as JSON");
  app.add_flag("--json", a->json, "print the table as JSON");
  app.add_option("--threads", a->threads, "threads to use, 0: one per core").not_negative().shown();
  add_progress_option(app, a->progress);
  app.on_run([a, app, &exit] {
    if (!a->tiles && !app.given("--at") && !app.given("--max-error"))
      refuse_missing("--at or --max-error");
    if (!a->tiles && app.given("--levels")) refuse_value("--levels", "is for --tiles");
    if (!app.given("--methods") && is_mesh(a->input.files[0]))
      std::erase(a->methods, "cluster");  // its cells are those of a grid
    exit = a->tiles ? run_tiles(app, *a) : run(*a);
  });
}

}  // namespace tind::cli
