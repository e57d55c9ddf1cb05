#include "server/cli/options/surface_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "server/cli/options/mesh_input.h"
#include "server/cli/program/exit.h"
#include "server/log/printable.h"
#include "terrain/base/file_there.h"
#include "terrain/raster/dem_options_text.h"
#include "terrain/surface/open_surface.h"

namespace tind::cli {

namespace {

constexpr double kMostMetres = 1e7;

/// Nothing where the text is no number; the error says what is wrong with one.
Result<std::optional<double>> metres(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end != text.data() + text.size() || error == std::errc::invalid_argument)
    return std::optional<double>();
  if (error != std::errc() || !std::isfinite(value))
    return fail(Errc::invalid_argument, text + " is not finite");
  if (value < 0) return fail(Errc::invalid_argument, text + " is negative");
  if (value > kMostMetres)
    return fail(Errc::invalid_argument,
                fmt::format("{} is too large: at most {:.0f} m", text, kMostMetres));
  return value;
}

/// "NAME=FILE[,FILE...]"
Result<LayerSpec> layer_of(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == text.npos || equals == 0 || equals + 1 == text.size())
    return fail(Errc::invalid_argument,
                "--layer " + text + ": takes NAME=FILE, or NAME=FILE,FILE of one grid");
  LayerSpec spec{text.substr(0, equals), {}};
  std::string rest = text.substr(equals + 1);
  const auto whole = is_there(rest);
  if (!whole) return std::unexpected(whole.error());
  if (*whole) {  // a name that holds a comma
    spec.files = {rest};
    return spec;
  }
  for (std::size_t at = 0; at <= rest.size();) {
    const auto comma = std::min(rest.find(',', at), rest.size());
    if (comma > at) spec.files.push_back(rest.substr(at, comma - at));
    at = comma + 1;
  }
  return spec;
}

/// "NAME=M"; or "M", where `all` can be set.
Result<void> add_metres(const char* option, const std::string& text, double* all,
                        std::vector<SurfaceOptions::OfLayer>& said) {
  const auto equals = text.rfind('=');
  const auto read = metres(equals == text.npos ? text : text.substr(equals + 1));
  if (!read)
    return fail(Errc::invalid_argument, fmt::format("{} {}: {}", option, text, read.error().what));
  const std::optional<double> value = *read;
  if (!value || (equals == text.npos && !all) || equals == 0)
    return fail(Errc::invalid_argument,
                fmt::format("{} {}: takes {}NAME=METRES", option, text, all ? "METRES, or " : ""));
  if (equals == text.npos)
    *all = *value;
  else
    said.push_back({text.substr(0, equals), *value});
  return {};
}

}  // namespace

void add_layer_options(Command app, SurfaceInput& input) {
  app.add_option("--layer", input.layers,
                 "NAME=FILE[,FILE...]: a layer, instead of DEM files; repeated, the lowest first. "
                 "(Without it files of one grid are a layer, finer ones above)")
      .repeated();
  app.add_option("--layer-option", input.options,
                 "NAME=OPTION:VALUE: what is said of one --layer in place of what is said of all "
                 "(from-datum, nodata, crs, band, encoding, scale, offset), as "
                 "town=from-datum:egm96")
      .repeated();
  app.add_option("--blend", input.blends,
                 "METRES, or NAME=METRES of one layer: how far beyond its posts a layer bends what "
                 "lies below it, so that no step shows; 0: not at all; at most 64 of its posts "
                 "(default: two spacings of the coarsest layer below)")
      .repeated();
  app.add_option("--layer-error", input.layer_errors,
                 "NAME=METRES: --max-error of one layer, where the pyramid ends with it")
      .repeated();
}

bool names_any(const DemInput& input, const SurfaceInput& layers) {
  return !input.files.empty() || !layers.layers.empty();
}

/// "NAME=OPTION:VALUE", into the layer's own options.
Result<void> add_option(const std::string& text, const DemOptions& of_all,
                        std::vector<LayerSpec>& layers) {
  const auto equals = text.find('='), colon = text.find(':', equals);
  const auto wrong = [&](const std::string& why) {
    return fail(Errc::invalid_argument, "--layer-option " + text + ": " + why);
  };
  if (equals == text.npos || equals == 0 || colon == text.npos || colon == equals + 1)
    return wrong("takes NAME=OPTION:VALUE, as town=from-datum:egm96");
  const auto layer = std::ranges::find(layers, text.substr(0, equals), &LayerSpec::name);
  if (layer == layers.end()) return wrong("there is no --layer '" + text.substr(0, equals) + "'");
  std::string name = text.substr(equals + 1, colon - equals - 1);
  std::ranges::replace(name, '-', '_');
  if (!layer->dem) layer->dem = of_all;
  if (const auto set = set_dem_option(name, text.substr(colon + 1), *layer->dem); !set)
    return wrong(set.error().code == Errc::not_found ? "there is no option of that name for DEMs"
                                                     : set.error().what);
  return {};
}

Result<SaidLayers> read_layers(const SurfaceInput& said, const DemOptions& options) {
  SaidLayers read{{}, {.dem = options}};
  SurfaceOptions& o = read.options;
  for (const std::string& text : said.blends)
    if (auto ok = add_metres("--blend", text, &o.blend_m, o.blends_m); !ok)
      return std::unexpected(ok.error());
  for (const std::string& text : said.layer_errors)
    if (auto ok = add_metres("--layer-error", text, nullptr, o.max_errors_m); !ok)
      return std::unexpected(ok.error());
  for (const std::string& text : said.layers) {
    auto spec = layer_of(text);
    if (!spec) return std::unexpected(spec.error());
    read.layers.push_back(std::move(*spec));
  }
  for (const std::string& text : said.options)
    if (auto ok = add_option(text, options, read.layers); !ok) return std::unexpected(ok.error());
  return read;
}

Result<Surface> open_surface(const DemInput& input, const SurfaceInput& said,
                             const DemOptions& options) {
  if (!input.files.empty() && !said.layers.empty())
    return fail(Errc::invalid_argument,
                "either DEM files, which make their layers themselves, or --layer");
  const auto read = read_layers(said, options);
  if (!read) return std::unexpected(read.error());
  auto surface = read->layers.empty() ? tind::open_surface(input.files, read->options)
                                      : tind::open_surface(read->layers, read->options);
  if (!surface) return std::unexpected(not_a_dem(surface.error(), input.files));
  warn_of(surface->info());
  if (surface->only() && !said.blends.empty())
    warn("--blend: there is only one layer, so there is nothing to blend");
  return surface;
}

Result<Surface> open_surface(const DemInput& input, const SurfaceInput& layers) {
  return open_surface(input, layers, dem_options(input));
}

void warn_of_nodata(const Surface& surface) {
  for (const SurfaceLayer& layer : surface.layers()) warn_of_nodata(*layer.source);
}

std::string layers_text(const Surface& surface) {
  std::string text;
  if (surface.only()) return text;
  for (std::size_t k = surface.layers().size(); k-- > 0;) {
    const SurfaceLayer& layer = surface.layers()[k];
    const DemInfo& info = layer.source->info();
    text += fmt::format(
        "layer {:<12} {:.4g} x {:.4g} m, {}, {}; {}\n", layer.name, info.spacing_x_m,
        info.spacing_y_m, k == 0 ? "at the bottom" : fmt::format("blend {:.4g} m", layer.blend_m),
        info.crs_name, logging::printable(fmt::format("{}", fmt::join(info.files, ", "))));
  }
  return text;
}

}  // namespace tind::cli
