#include "terrain/surface/open_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <set>

#include "terrain/raster/dem_files.h"
#include "terrain/shapes/shaped_dem.h"
#include "terrain/shapes/surface_shapes.h"

namespace tind {

namespace {

std::string stem(const std::string& path) {
  const std::string name = path.substr(path.find_last_of('/') + 1);
  return name.substr(0, name.find('.'));
}

std::string names_of(const std::vector<SurfaceLayer>& layers) {
  std::string names;
  for (const SurfaceLayer& layer : layers) names += (names.empty() ? "" : ", ") + layer.name;
  return names;
}

Result<void> apply(const std::vector<SurfaceOptions::OfLayer>& said, double SurfaceLayer::*member,
                   std::vector<SurfaceLayer>& layers) {
  for (const auto& [name, metres] : said) {
    const auto layer = std::ranges::find(layers, name, &SurfaceLayer::name);
    if (layer == layers.end())
      return fail(Errc::invalid_argument,
                  "there is no layer '" + name + "'; the layers are " + names_of(layers));
    (*layer).*member = metres;
  }
  return {};
}

/// What is said of all layers may contradict what all of them say, not what some do: whoever says
/// it of those that do not would shift the others by the height of a geoid.
Result<void> check_datums(std::span<const SurfaceLayer> layers) {
  const auto overruled = [](const SurfaceLayer& layer) {
    return !layer.source->info().overruled_datum.empty();
  };
  const auto one = std::ranges::find_if(layers, overruled);
  const auto other = std::ranges::find_if_not(layers, overruled);
  if (one == layers.end() || other == layers.end()) return {};
  const DemInfo &a = one->source->info(), &b = other->source->info();
  return fail(Errc::invalid_argument,
              a.files[0] + " says that its heights are above " + a.overruled_datum + ", and " +
                  b.files[0] +
                  " does not: one --from-datum for both would shift one of them; say it "
                  "of single layers (--layer with --layer-option, or layers of a dataset)");
}

Result<Surface> surface_of(std::vector<SurfaceLayer> layers, const SurfaceOptions& options) {
  for (SurfaceLayer& layer : layers) layer.blend_m = options.blend_m;
  if (auto done = apply(options.blends_m, &SurfaceLayer::blend_m, layers); !done)
    return std::unexpected(done.error());
  if (auto done = apply(options.max_errors_m, &SurfaceLayer::max_error_m, layers); !done)
    return std::unexpected(done.error());
  return Surface::of_layers(std::move(layers));
}

/// Do two files share a grid? As far as what they say of themselves leaves no doubt: the same words
/// for the CRS, and steps that are the same or far from it. Of thousands of files only few leave
/// one, and opening two more files for each pair would take minutes.
std::optional<bool> plainly_share_grid(const DemInfo& a, const DemInfo& b) {
  constexpr double kFar = 1e-3, kWhole = 1e-3;  // of a step
  if (!a.has_geotransform || !b.has_geotransform || a.crs_wkt.empty() || a.crs_wkt != b.crs_wkt ||
      a.source_datum != b.source_datum || a.vertical_crs != b.vertical_crs || a.wraps_longitude ||
      b.wraps_longitude)
    return {};
  const Affine &m = a.post_to_crs, &n = b.post_to_crs;
  const double step = std::max(std::abs(m.x_col), std::abs(m.y_row));
  const auto differ = [step](double p, double q) { return std::abs(p - q) > kFar * step; };
  if (differ(m.x_col, n.x_col) || differ(m.x_row, n.x_row) || differ(m.y_col, n.y_col) ||
      differ(m.y_row, n.y_row))
    return false;
  if (m.x_col != n.x_col || m.x_row != n.x_row || m.y_col != n.y_col || m.y_row != n.y_row)
    return {};
  const Vec2 offset = m.invert(n.x0, n.y0);
  const auto whole = [](double posts) { return std::abs(posts - std::round(posts)) < kWhole; };
  return whole(offset.x) && whole(offset.y) ? std::optional(true) : std::nullopt;
}

/// Files by grid, in the order in which grids come first.
Result<std::vector<std::vector<std::string>>> by_grid(std::span<const std::string> files,
                                                      const DemOptions& dem) {
  std::vector<std::vector<std::string>> groups;
  std::vector<DemInfo> firsts;  // of each group's first file
  for (const std::string& file : files) {
    const auto alone = DemSource::open({&file, 1}, dem);
    if (!alone) return std::unexpected(alone.error());
    const DemInfo& info = (*alone)->info();
    const auto fits = [&](const DemInfo& first) {
      if (const auto plain = plainly_share_grid(first, info)) return *plain;
      return DemSource::open(std::array{first.files.front(), file}, dem).has_value();
    };
    const auto first = std::ranges::find_if(firsts, fits);
    if (first != firsts.end()) {
      groups[std::size_t(first - firsts.begin())].push_back(file);
    } else {
      groups.push_back({file});
      firsts.push_back(info);
    }
  }
  return groups;
}

}  // namespace

Result<Surface> open_surface(std::span<const LayerSpec> specs, const SurfaceOptions& options) {
  std::vector<SurfaceLayer> layers, shared;
  for (const LayerSpec& spec : specs) {
    if (std::ranges::find(layers, spec.name, &SurfaceLayer::name) != layers.end())
      return fail(Errc::invalid_argument, "two layers are named '" + spec.name + "'");
    auto source = DemSource::open(spec.files, spec.dem.value_or(options.dem));
    if (!source) return fail("layer " + spec.name, source.error());
    layers.push_back({spec.name, std::move(*source)});
    // What is said of a single layer is meant for it.
    if (!spec.dem || spec.dem->from_datum == options.dem.from_datum)
      shared.push_back(layers.back());
  }
  if (auto ok = check_datums(shared); !ok) return std::unexpected(ok.error());
  return surface_of(std::move(layers), options);
}

Result<Surface> open_surface(std::span<const std::string> files, const SurfaceOptions& options) {
  auto one = DemSource::open(files, options.dem);
  if (one) return surface_of({{stem(files[0]), std::move(*one)}}, options);
  if (one.error().code != Errc::unsupported) return std::unexpected(one.error());
  const auto named = dem_files(files, options.dem);  // those of folders and lists, too
  if (!named) return std::unexpected(named.error());
  if (named->files.size() < 2) return std::unexpected(one.error());
  const auto groups = by_grid(named->files, options.dem);
  if (!groups) return std::unexpected(groups.error());
  if (groups->size() < 2) return std::unexpected(one.error());
  std::vector<SurfaceLayer> layers;
  std::set<std::string> names;
  for (const std::vector<std::string>& group : *groups) {
    auto source = DemSource::open(group, options.dem);
    if (!source) return std::unexpected(source.error());
    std::string name = stem(group.front());
    for (int n = 2; !names.insert(name).second; ++n)
      name = stem(group.front()) + "-" + std::to_string(n);
    layers.push_back({name, std::move(*source)});
  }
  if (auto ok = check_datums(layers); !ok) return std::unexpected(ok.error());
  std::ranges::reverse(layers);
  std::ranges::stable_sort(layers, std::greater{}, [](const SurfaceLayer& layer) {
    return rank_spacing_m(layer.source->info());
  });
  return surface_of(std::move(layers), options);
}

Result<Surface> shaped_surface(Surface surface, const ShapeFiles& files) {
  if (!files.any()) return surface;
  std::vector<SurfaceLayer> layers(surface.layers().begin(), surface.layers().end());
  std::vector<std::shared_ptr<const DemSource>> sources;
  sources.reserve(layers.size());
  for (const SurfaceLayer& layer : layers) sources.push_back(layer.source);
  const auto shapes = SurfaceShapes::make(sources, files);
  if (!shapes) return std::unexpected(shapes.error());
  for (SurfaceLayer& layer : layers) layer.source = shaped_dem(layer.source, *shapes);
  return Surface::of_layers(std::move(layers));
}

}  // namespace tind
