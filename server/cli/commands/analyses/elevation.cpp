// tind elevation: the heights of places, of a DEM or of what clients of a level of tiles see.

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "proto/csv.h"
#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/level_input.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/options/place_input.h"
#include "server/cli/options/tin_input.h"
#include "terrain/analysis/heights_at.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/file_io.h"
#include "terrain/mesh/mesh_file.h"
#include "terrain/raster/crs_points.h"
#include "terrain/raster/datums.h"

namespace tind::cli {

namespace {

using Ordered = nlohmann::ordered_json;

// Of a table: memory has a bound, whatever its size.
constexpr std::size_t kLinesAtATime = 100'000, kBytesAtATime = 16u << 20;

struct Arguments {
  DemInput dem;
  LevelInput level;
  std::vector<std::string> at;
  std::string table, crs = "CRS84", output;
  Interpolation interpolation = Interpolation::bilinear;
  bool json = false;
};

struct Found {
  HeightAt height;
  std::optional<double> max_error_m;  // of tiles: no post of the tile is farther from its mesh
};

/// Whoever has the heights.
struct Asked {
  std::shared_ptr<const DemSource> dem;  // null: a TIN, or tiles
  std::shared_ptr<const TinGround> tin;
  std::shared_ptr<const TileSet> tiles;
  std::string datum;
  Geographic middle{};

  Result<std::vector<Found>> heights(const Arguments& a, std::span<const Geographic> places) const {
    std::vector<Found> found(places.size());
    if (dem) {
      const auto heights = heights_at(Surface(dem), places, a.interpolation);
      if (!heights) return std::unexpected(heights.error());
      for (std::size_t i = 0; i < found.size(); ++i) found[i].height = (*heights)[i].height;
      return found;
    }
    if (tin) {
      const auto heights = heights_at(*tin, places);
      if (!heights) return std::unexpected(heights.error());
      for (std::size_t i = 0; i < found.size(); ++i) found[i].height = (*heights)[i];
      return found;
    }
    const auto heights = level_heights(level_tiles_of(*tiles), places, a.level.level);
    if (!heights) return std::unexpected(heights.error());
    for (std::size_t i = 0; i < found.size(); ++i)
      if (const auto& seen = (*heights)[i])
        found[i] = {{Coverage::value, seen->height_m}, seen->max_error_m};
    return found;
  }
};

Result<Asked> open_asked(const Arguments& a) {
  Asked asked;
  if (!a.level.tiles.empty()) {
    if (!a.dem.files.empty())
      return fail(Errc::invalid_argument, "heights are of a DEM or of --tiles, not of both");
    if (a.interpolation != Interpolation::bilinear)
      return fail(Errc::invalid_argument, "--interpolation is for a DEM: tiles are meshes");
    const auto tiles = open_level_tiles(a.level);
    if (!tiles) return std::unexpected(tiles.error());
    asked.tiles = *tiles;
    asked.datum = name(datum_of(**tiles));
    return asked;
  }
  if (a.dem.files.empty())
    return fail(Errc::invalid_argument, "heights are of a DEM or a TIN, or of --tiles: name one");
  if (asks_tin_itself(a.dem)) {
    if (a.interpolation != Interpolation::bilinear)
      return fail(Errc::invalid_argument, "--interpolation is for a DEM: a TIN is its triangles");
    auto ground = open_tin_ground(a.dem);
    if (!ground) return std::unexpected(ground.error());
    asked.tin = std::make_shared<const TinGround>(std::move(*ground));
  } else {
    const auto dem = open_dem(a.dem);
    if (!dem) return std::unexpected(dem.error());
    asked.dem = *dem;
  }
  const DemInfo& info = asked.dem ? asked.dem->info() : asked.tin->frame->info();
  asked.datum = name(info.datum);
  asked.middle = {(info.bounds.west + info.bounds.east) / 2,
                  (info.bounds.south + info.bounds.north) / 2};
  return asked;
}

const char* word(Coverage coverage) {
  return coverage == Coverage::value ? "value" : coverage == Coverage::void_ ? "void" : "outside";
}

// --- --at ----------------------------------------------------------------------------------------

Ordered to_json(const Geographic& place, const Found& found) {
  Ordered json = {
      {"lon", place.lon}, {"lat", place.lat}, {"coverage", word(found.height.coverage)}};
  json["height_m"] =
      found.height.coverage == Coverage::value ? Ordered(found.height.height_m) : Ordered(nullptr);
  if (found.max_error_m) json["max_error_m"] = *found.max_error_m;
  return json;
}

int tell(const Arguments& a, const Asked& asked) {
  std::string all;
  for (const std::string& place : a.at) all += (all.empty() ? "" : " ") + place;
  const auto places = read_places(all, "--at", a.crs, asked.middle);
  if (!places) return complain(places.error());
  const auto found = asked.heights(a, *places);
  if (!found) return complain_of(a.dem, found.error());
  if (a.json) {
    Ordered list = Ordered::array();
    for (std::size_t i = 0; i < found->size(); ++i)
      list.push_back(to_json((*places)[i], (*found)[i]));
    std::printf("%s\n",
                json::to_text(Ordered{{"datum", asked.datum}, {"places", list}}, 2).c_str());
    return kOk;
  }
  for (std::size_t i = 0; i < found->size(); ++i) {
    const Found& f = (*found)[i];
    fmt::print("{:.7f},{:.7f}: ", (*places)[i].lon, (*places)[i].lat);
    if (f.height.coverage == Coverage::value)
      fmt::print("{:.3f} m above {}{}\n", f.height.height_m, asked.datum,
                 f.max_error_m ? fmt::format(", posts within {:.3f} m", *f.max_error_m) : "");
    else
      fmt::print("{}\n", word(f.height.coverage));
  }
  return kOk;
}

// --- --places ------------------------------------------------------------------------------------

/// A table line by line, and the same with its heights.
class Table {
 public:
  using Take = std::function<Result<void>(std::string_view)>;

  /// `take`: gets the table, some lines at a time.
  Table(const Arguments& a, const Asked& asked, std::istream& in, Take take)
      : a_(a), asked_(asked), in_(in), give_(std::move(take)) {}

  Result<void> run() {
    std::string head;
    while (head.empty() && next(head)) {
    }
    if (head.starts_with("\xef\xbb\xbf")) head.erase(0, 3);
    if (csv::has_open_quote(head)) return wrong(number_, csv::kOpenQuote);
    const auto columns = csv::PlaceColumns::in(head, is_geographic(a_.crs));
    if (!columns) return wrong(1, columns.error().what);
    columns_ = *columns;
    const std::string added = asked_.tiles ? "height_m,coverage,max_error_m" : "height_m,coverage";
    if (const std::string why = csv::why_no_columns(head, added); !why.empty())
      return wrong(1, why);
    text_ = head + "," + added + "\n";
    for (std::string line; next(line);) {
      if (line.empty()) continue;
      if (auto ok = take(line); !ok) return ok;
      if (lines_.size() < kLinesAtATime && bytes_ < kBytesAtATime) continue;
      if (auto ok = flush(); !ok) return ok;
    }
    if (in_.bad()) return fail(Errc::io, name() + ": cannot be read on");
    return flush();
  }
  std::size_t places() const { return places_; }
  std::size_t without() const { return without_; }

 private:
  const Arguments& a_;
  const Asked& asked_;
  std::istream& in_;
  const Take give_;
  std::string text_;  // on its way out
  csv::PlaceColumns columns_;
  struct Line {
    std::string text;
    std::size_t number, lacks;  // fields that the head line has
  };
  std::vector<Line> lines_;
  std::size_t bytes_ = 0;  // of these lines, as wide as the head line
  std::vector<Vec2> points_;
  std::size_t number_ = 0, places_ = 0, without_ = 0;

  std::string name() const { return a_.table == "-" ? "standard input" : a_.table; }
  std::unexpected<Error> wrong(std::size_t line, const std::string& what) const {
    return fail(Errc::bad_data, fmt::format("{}: line {} {}", name(), line, what));
  }
  bool next(std::string& line) {
    if (!std::getline(in_, line)) return false;
    if (line.ends_with('\r')) line.pop_back();
    ++number_;
    return true;
  }

  Result<void> take(const std::string& line) {
    if (csv::has_open_quote(line)) return wrong(number_, csv::kOpenQuote);
    const csv::PlaceFields place = columns_.of(line);
    if (!place.x || !place.y) return wrong(number_, "has no two coordinates");
    if (place.count > columns_.count) return wrong(number_, csv::kTooWide);
    lines_.push_back({line, number_, columns_.count - place.count});
    bytes_ += line.size() + lines_.back().lacks;
    points_.push_back({*place.x, *place.y});
    return {};
  }

  Result<void> flush() {
    const auto places = to_places(points_, a_.crs, asked_.middle, [this](std::size_t i) {
      return fmt::format("{}: line {}", name(), lines_[i].number);
    });
    if (!places) return std::unexpected(places.error());
    const auto found = asked_.heights(a_, *places);
    if (!found) return std::unexpected(found.error());
    for (std::size_t i = 0; i < lines_.size(); ++i) put(lines_[i], (*found)[i]);
    places_ += lines_.size();
    lines_.clear(), points_.clear();
    bytes_ = 0;
    auto given = give_(text_);
    text_.clear();
    return given;
  }

  void put(const Line& line, const Found& found) {
    const bool there = found.height.coverage == Coverage::value;
    without_ += !there;
    (text_ += line.text).append(line.lacks, ',');
    fmt::format_to(std::back_inserter(text_), ",{},{}",
                   there ? Ordered(found.height.height_m).dump() : "", word(found.height.coverage));
    if (asked_.tiles)
      text_ += "," + (found.max_error_m ? Ordered(*found.max_error_m).dump() : std::string());
    text_ += '\n';
  }
};

Result<void> print_now(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0)
    return {};
  return fail(Errc::io, fmt::format("standard output: {}", errno_text(errno)));
}

int fill_table(const Arguments& a, const Asked& asked) {
  std::ifstream file;
  if (a.table != "-") {
    file.open(a.table);
    if (!file) return complain({Errc::not_found, a.table + ": no such file, or not to be read"});
  }
  std::istream& in = a.table == "-" ? std::cin : file;
  if (a.output.empty()) {
    const auto done = Table(a, asked, in, print_now).run();
    return done ? kOk : complain_of(a.dem, done.error());
  }
  auto out = FileWriter::create(a.output);
  if (!out) {
    complain(out.error());
    return kCannotCreate;
  }
  Table table(a, asked, in, [&](std::string_view text) { return out->write(text); });
  auto done = table.run();
  if (done) done = out->finish();  // not before it is whole
  if (!done) return complain_of(a.dem, done.error());
  fmt::print("{}: {} places, {} without height; above {}\n", a.output, table.places(),
             table.without(), asked.datum);
  return kOk;
}

int run(const Arguments& a) {
  std::vector<std::string> inputs = inputs_of(a.dem);
  if (!a.table.empty() && a.table != "-") inputs.push_back(a.table);
  if (!a.at.empty() && !a.output.empty())
    return complain({Errc::invalid_argument, "--output is for the table that --places makes"});
  if (!a.table.empty() && a.json)
    return complain({Errc::invalid_argument, "--json is for --at: --places makes a table"});
  if (const int code = check_outputs({a.output}, inputs); code != kOk) return code;
  const auto asked = open_asked(a);
  if (!asked) return complain(asked.error());
  return a.at.empty() ? fill_table(a, *asked) : tell(a, *asked);
}

}  // namespace

void add_elevation(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command app =
      program.add_subcommand("elevation", "Heights of places: of one, or of those in a table");
  app.add_option("input", a->dem.files,
                 "a DEM, or several that share one grid; or a TIN: " + readable_extensions());
  Command which = app.add_group("Where (exactly one)", 1, 1);
  which.add_option("--at", a->at, "X,Y: a place; as often as there are places").repeated();
  which.add_option("--places", a->table,
                   std::string("a CSV file whose first line names the columns ") +
                       csv::kPlaceColumns +
                       ", or - for standard input; comes back with height_m and coverage");
  add_places_crs(app, a->crs);
  app.add_choice("--interpolation", a->interpolation, "between the posts of a DEM").shown();
  app.add_option("-o,--output", a->output, "the table, in place of standard output");
  add_level_options(app, a->level);
  add_dem_options(app, a->dem);
  add_json_flag(app, a->json);
  app.footer(
      "Examples: tind elevation alps.tif --at 7.6586,45.9764\n"
      "          tind elevation alps.tif --places huts.csv -o huts_with_heights.csv");
  app.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
