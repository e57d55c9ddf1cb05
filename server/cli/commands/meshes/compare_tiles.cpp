#include "server/cli/commands/meshes/compare_tiles.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

#include "proto/json_text.h"
#include "server/cli/options/tile_options.h"
#include "server/cli/program/exit.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/base/parallel.h"
#include "terrain/encode/quantized_mesh_tile.h"
#include "terrain/pyramid/build/build.h"
#include "terrain/pyramid/make/make_tile.h"
#include "terrain/pyramid/plan/plan_source.h"
#include "terrain/pyramid/plan/tile_method.h"
#include "terrain/surface/surface.h"

namespace tind::cli {

namespace {

using Json = nlohmann::ordered_json;

struct MadeTile {
  double bytes = 0, gzip = 0, triangles = 0, seconds = 0, error_m = 0;
  bool by_bounded = false;
};

struct Spread {
  double sum = 0, mean = 0, median = 0, most = 0;
};

/// Of some tiles. REQUIRES: at least one.
Spread spread_of(const std::vector<MadeTile>& tiles, double MadeTile::*what) {
  std::vector<double> values;
  values.reserve(tiles.size());
  for (const MadeTile& t : tiles) values.push_back(t.*what);
  std::ranges::sort(values);
  Spread s;
  for (const double v : values) s.sum += v;
  const std::size_t n = values.size();
  s.mean = s.sum / double(n);
  s.median = (values[n / 2] + values[(n - 1) / 2]) / 2;
  s.most = values.back();
  return s;
}

/// The tiles of a level by one method, or of all levels (level -1).
struct Group {
  std::string method;
  int level = -1;
  std::vector<MadeTile> tiles;
};

Result<MadeTile> make(const Surface& surface, const TilePlan& plan, TileId id,
                      std::stop_token stop) {
  const auto begin = std::chrono::steady_clock::now();
  TileCost cost;
  const auto model = model_tile(surface, plan, id, std::move(stop), &cost);
  if (!model) return std::unexpected(model.error());
  const auto bytes = encode_quantized_mesh(*model);
  MadeTile made;
  made.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  made.bytes = double(bytes.size()), made.gzip = double(gzipped(bytes).size());
  made.triangles = double(model->mesh.triangles.size());
  made.error_m = model->certificate->max_error_m;
  made.by_bounded = cost.by_bounded;
  return made;
}

/// All tiles by one method, by level, all of them first.
Result<std::vector<Group>> make_all(const Surface& surface, const std::string& name,
                                    const TileSetOptions& options, int threads,
                                    const Progress& progress) {
  const auto plan = plan_source(surface, options, "", threads, progress.part(0, 0.1));
  if (!plan) return std::unexpected(plan.error());
  const TileOrder ids = plan->order();
  std::vector<MadeTile> tiles(ids.size());
  std::mutex mutex;
  std::optional<Error> wrong;
  std::size_t done = 0;
  parallel_for(ids.size(), threads, [&](std::size_t i) {
    auto made = make(surface, *plan, ids[i], progress.stop);
    const std::lock_guard lock(mutex);
    if (made)
      tiles[i] = *made;
    else if (!wrong)
      wrong = made.error();
    progress.part(0.1, 1).at(double(++done) / double(ids.size()));
  });
  if (wrong) return std::unexpected(*wrong);
  std::vector<Group> groups = {{name, -1, tiles}};
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (groups.size() == 1 || groups.back().level != ids[i].level)
      groups.push_back({name, ids[i].level, {}});
    groups.back().tiles.push_back(tiles[i]);
  }
  return groups;
}

std::size_t by_bounded(const Group& g) {
  return std::size_t(std::ranges::count(g.tiles, true, &MadeTile::by_bounded));
}

Json json_of(const Group& g) {
  const auto both = [&](double MadeTile::*what) {
    const Spread s = spread_of(g.tiles, what);
    return Json{{"all", s.sum}, {"mean", s.mean}, {"median", s.median}};
  };
  Json j;
  if (g.level >= 0) j["level"] = g.level;
  j["tiles"] = g.tiles.size();
  j["bytes"] = both(&MadeTile::bytes);
  j["bytes_gzip"] = both(&MadeTile::gzip);
  j["triangles"] = both(&MadeTile::triangles);
  j["seconds"] = both(&MadeTile::seconds);
  j["worst_error_m"] = spread_of(g.tiles, &MadeTile::error_m).most;
  j["by_bounded"] = by_bounded(g);
  return j;
}

Json to_json(const std::vector<std::vector<Group>>& all) {
  Json j = Json::array();
  for (const std::vector<Group>& groups : all) {
    Json one = {{"method", groups[0].method}};
    one.update(json_of(groups[0]));
    for (std::size_t k = 1; k < groups.size(); ++k) one["levels"].push_back(json_of(groups[k]));
    j.push_back(std::move(one));
  }
  return j;
}

std::string heading(const char* first) {
  return fmt::format("{:<16} {:>6} {:>10} {:>8} {:>10} {:>10} {:>8} {:>8} {:>8} {:>8}\n", first,
                     "tiles", "bytes/tile", "median", "gzip/tile", "triangles", "median", "ms/tile",
                     "median", "worst m");
}

std::string line(const std::string& first, const Group& g) {
  const Spread bytes = spread_of(g.tiles, &MadeTile::bytes);
  const Spread triangles = spread_of(g.tiles, &MadeTile::triangles);
  const Spread seconds = spread_of(g.tiles, &MadeTile::seconds);
  return fmt::format(
      "{:<16} {:>6} {:>10.0f} {:>8.0f} {:>10.0f} {:>10.1f} {:>8.0f} {:>8.1f} {:>8.1f} {:>8.2f}{}\n",
      first, g.tiles.size(), bytes.mean, bytes.median, spread_of(g.tiles, &MadeTile::gzip).mean,
      triangles.mean, triangles.median, 1000 * seconds.mean, 1000 * seconds.median,
      spread_of(g.tiles, &MadeTile::error_m).most,
      by_bounded(g) > 0 ? fmt::format("  ({} by bounded)", by_bounded(g)) : "");
}

std::string to_text(const std::vector<std::vector<Group>>& all) {
  std::string out = heading("all levels");
  for (const std::vector<Group>& groups : all) out += line(groups[0].method, groups[0]);
  for (std::size_t k = 1; k < all[0].size(); ++k) {
    out += "\n" + heading(fmt::format("level {}", all[0][k].level).c_str());
    for (const std::vector<Group>& groups : all) out += line(groups[k].method, groups[k]);
  }
  return out;
}

}  // namespace

int compare_tiles(const CompareTiles& c) {
  for (const auto& [name, options] : c.methods)
    if (const auto ok = check_tile_method(options.method); !ok) return complain(ok.error());
  const auto source = open_dem(c.input);
  if (!source) return complain(source.error());
  warn_of_plan(**source, c.methods[0].second);
  std::vector<std::vector<Group>> all;
  {
    ProgressBar bar("tiles", progress_style(c.progress));
    const Progress progress = bar.progress();
    const double share = 1.0 / double(c.methods.size());
    for (const auto& [name, options] : c.methods) {
      const double from = share * double(all.size());
      auto groups = make_all(**source, name, options, c.threads, progress.part(from, from + share));
      if (!groups) return complain(groups.error());
      all.push_back(std::move(*groups));
    }
  }
  fmt::print("{}", c.json ? json::to_text(to_json(all), 1) + "\n" : to_text(all));
  return kOk;
}

}  // namespace tind::cli
