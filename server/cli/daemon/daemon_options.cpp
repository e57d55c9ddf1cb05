#include "server/cli/daemon/daemon_options.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <utility>

#include "server/services/datasets/dataset_settings.h"
#include "server/services/datasets/dataset_spec.h"
#include "terrain/surface/open_surface.h"

namespace tind::cli {
namespace {

std::vector<std::string> environment_names() {
  std::vector<std::string> names;
  for (char** entry = environ; *entry; ++entry)
    names.emplace_back(*entry, std::strcspn(*entry, "="));
  return names;
}

/// What --layer, --blend and --layer-error name: one dataset, called as its lowest layer.
Result<std::vector<services::DatasetSpec>> dataset_of_layers(const SurfaceInput& said) {
  if (said.layers.empty() && said.blends.empty() && said.layer_errors.empty() &&
      said.options.empty())
    return std::vector<services::DatasetSpec>{};
  if (said.layers.empty())
    return fail(Errc::invalid_argument,
                "--blend, --layer-error and --layer-option are of the layers that --layer names; "
                "those of datasets in a file are said there, [[dataset.layer]]");
  const auto read = read_layers(said, {});
  if (!read) return std::unexpected(read.error());
  services::DatasetSpec spec{.name = services::safe_name(read->layers.front().name), .files = {}};
  for (const LayerSpec& layer : read->layers) {
    spec.layers.push_back({layer.name, layer.files});
    spec.files.insert(spec.files.end(), layer.files.begin(), layer.files.end());
    if (read->options.blend_m >= 0)
      spec.layers.back().own["blend"] = fmt::format("{}", read->options.blend_m);
  }
  const auto say = [&](const char* key, const SurfaceOptions::OfLayer& one) -> Result<void> {
    const auto layer = std::ranges::find(spec.layers, one.name, &services::LayerTable::name);
    if (layer == spec.layers.end())
      return fail(Errc::invalid_argument,
                  fmt::format("there is no layer '{}' ({})", one.name, key));
    layer->own[key] = fmt::format("{}", one.metres);
    return {};
  };
  for (const auto& one : read->options.blends_m)
    if (auto said_it = say("blend", one); !said_it) return std::unexpected(said_it.error());
  for (const auto& one : read->options.max_errors_m)
    if (auto said_it = say("error", one); !said_it) return std::unexpected(said_it.error());
  for (const std::string& text : said.options) {  // NAME=OPTION:VALUE, as read_layers() has seen
    const auto equals = text.find('='), colon = text.find(':', equals);
    const auto layer =
        std::ranges::find(spec.layers, text.substr(0, equals), &services::LayerTable::name);
    layer->own[text.substr(equals + 1, colon - equals - 1)] = text.substr(colon + 1);
  }
  return std::vector{std::move(spec)};
}

/// A flag that is for DEMs, beside nothing but finished tiles, would be one that nobody hears.
Result<void> flags_are_heard(const DaemonOptions& options, const services::Config& config) {
  const auto specs = services::specs_of(config);
  if (!config.catalog.empty() || specs.empty() || !std::ranges::all_of(specs, services::is_stored))
    return {};
  std::string unheard;
  for (const auto& [name, text] : options.flags)
    if (services::dataset_setting(name)) unheard += (unheard.empty() ? "--" : ", --") + name;
  if (unheard.empty()) return {};
  return fail(Errc::invalid_argument,
              specs[0].files[0] +
                  ": holds tiles, which are served as they were made; leave out what is for a "
                  "DEM: " +
                  unheard);
}

}  // namespace

Result<services::Config> configure(const DaemonOptions& options) {
  auto layers = dataset_of_layers(options.layers);
  if (!layers) return std::unexpected(layers.error());
  auto config = services::read_config(
      {.file = options.config_file,
       .environment = [](const std::string& key) -> std::optional<std::string> {
         const char* const value = std::getenv(key.c_str());
         return value ? std::optional<std::string>(value) : std::nullopt;
       },
       .environment_names = environment_names(),
       .flags = options.flags,
       .datasets = options.datasets,
       .tables = std::move(*layers)});
  if (!config) return config;
  if (auto heard = flags_are_heard(options, *config); !heard) return std::unexpected(heard.error());
  return config;
}

}  // namespace tind::cli
