#include "server/services/datasets/config.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>

#include "terrain/base/edit_distance.h"
#include "terrain/raster/nodata.h"

namespace tind::services {
namespace {

// --- the kinds of settings -----------------------------------------------------------------------

std::string quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\u{:04x}", int(c));
    } else {
      out += c;
    }
  }
  return out + '"';
}

Setting text(std::string name, std::string help, std::string Config::*field) {
  return {std::move(name), std::move(help), false,
          [field](Config& config, std::string_view value) -> Result<void> {
            config.*field = value;
            return {};
          },
          [field](const Config& config) { return quoted(config.*field); }};
}

Setting choice(std::string name, std::string help, std::string Config::*field,
               std::vector<std::string> values) {
  Setting setting = text(std::move(name), std::move(help), field);
  setting.set = [field, values](Config& config, std::string_view value) -> Result<void> {
    if (std::ranges::find(values, value) == values.end())
      return fail(Errc::invalid_argument,
                  fmt::format("must be one of {}", fmt::join(values, ", ")));
    config.*field = value;
    return {};
  };
  return setting;
}

template <NamedEnum E>
Setting choice(std::string name, std::string help, E Config::*field) {
  return {std::move(name), std::move(help), false,
          [field](Config& config, std::string_view value) -> Result<void> {
            const auto chosen = enum_named<E>(value);
            if (!chosen)
              return fail(Errc::invalid_argument,
                          fmt::format("must be one of {}", fmt::join(enum_names<E>(), ", ")));
            config.*field = *chosen;
            return {};
          },
          [field](const Config& config) { return quoted(name_of(config.*field)); }};
}

template <class Number>
Setting number(std::string name, std::string help, Number Config::*field, Number low, Number high) {
  return {std::move(name), std::move(help), false,
          [=](Config& config, std::string_view value) -> Result<void> {
            Number parsed{};
            const char* const end = value.data() + value.size();
            const auto [stop, error] = std::from_chars(value.data(), end, parsed);
            if (error != std::errc() || stop != end || !(parsed >= low && parsed <= high))
              return fail(Errc::invalid_argument,
                          fmt::format("must be a number from {} to {}", low, high));
            config.*field = parsed;
            return {};
          },
          [field](const Config& config) { return fmt::format("{}", config.*field); }};
}

Setting toggle(std::string name, std::string help, bool Config::*field) {
  return {std::move(name), std::move(help), true,
          [field](Config& config, std::string_view value) -> Result<void> {
            if (value != "true" && value != "false")
              return fail(Errc::invalid_argument, "must be true or false");
            config.*field = value == "true";
            return {};
          },
          [field](const Config& config) { return std::string(config.*field ? "true" : "false"); }};
}

Setting nodata_setting() {
  Setting setting = text("nodata",
                         "values that mean no data in the DEMs, beside those that they declare: "
                         "-9999 or -9999,-32768; none: the declared ones are heights",
                         &Config::nodata);
  setting.set = [](Config& config, std::string_view value) -> Result<void> {
    DemOptions options;
    if (!value.empty() && !set_nodata(value, options))
      return fail(Errc::invalid_argument, "must be numbers with commas between, or none");
    config.nodata = value;
    return {};
  };
  return setting;
}

Setting listen_setting() {
  Setting setting =
      text("listen", "where to listen: ADDRESS:PORT; port 0 picks a free one", &Config::listen);
  setting.set = [](Config& config, std::string_view value) -> Result<void> {
    if (auto parsed = parse_listen(value); !parsed) return std::unexpected(parsed.error());
    config.listen = value;
    return {};
  };
  return setting;
}

// --- names ---------------------------------------------------------------------------------------

std::string file_key(std::string name) {
  std::ranges::replace(name, '-', '_');
  return name;
}

std::string environment_key(std::string_view name) {
  std::string key = "TIND_";
  for (const char c : name)
    key += c == '-' ? '_' : char(std::toupper(static_cast<unsigned char>(c)));
  return key;
}

/// `name_of`: how a setting is called where the unknown name was found.
template <class NameOf>
std::string suggestion(std::string_view unknown, NameOf&& name_of) {
  std::string best;
  std::size_t distance = 1 + unknown.size() / 3;
  const auto consider = [&](const std::string& key) {
    const std::size_t d = edit_distance(unknown, key);
    if (d > distance) return;
    distance = d;
    best = key;
  };
  for (const Setting& setting : settings()) consider(name_of(setting.name));
  return best.empty() ? "; see tind serve --print-config for all" : "; did you mean " + best + "?";
}

/// Not settings of the daemon: where its data lies, the program that tests run, and what Kubernetes
/// tells every pod about a service that is called "tind".
bool is_other_variable(std::string_view key) {
  return key == "TIND_DATA" || key == "TIND_BINARY" || key == "TIND_PORT" ||
         key.starts_with("TIND_PORT_") || key.starts_with("TIND_SERVICE_");
}

Result<void> check_environment(const std::vector<std::string>& names) {
  for (const std::string& key : names) {
    if (!key.starts_with("TIND_") || is_other_variable(key)) continue;
    const bool known = std::ranges::any_of(
        settings(), [&](const Setting& setting) { return environment_key(setting.name) == key; });
    if (!known)
      return fail(Errc::invalid_argument, "environment: unknown variable " + key +
                                              suggestion(key, [](const std::string& name) {
                                                return environment_key(name);
                                              }));
  }
  return {};
}

// --- the sources ---------------------------------------------------------------------------------

Result<void> set(Config& config, const Setting& setting, std::string_view value,
                 const std::string& where) {
  if (auto done = setting.set(config, value); !done)
    return fail(done.error().code, fmt::format("{}: {} {}, not \"{}\"", where, setting.name,
                                               done.error().what, value));
  return {};
}

/// A scalar as the text that a flag would have; nothing for tables, arrays and dates.
std::optional<std::string> scalar_text(const toml::node& node) {
  if (const auto* value = node.as_string()) return value->get();
  if (const auto* value = node.as_integer()) return std::to_string(value->get());
  if (const auto* value = node.as_floating_point()) return fmt::format("{}", value->get());
  if (const auto* value = node.as_boolean()) return std::string(value->get() ? "true" : "false");
  return std::nullopt;
}

Result<void> read_datasets(Config& config, const toml::node& node, const std::string& where) {
  const toml::array* const list = node.as_array();
  if (!list) return fail(Errc::invalid_argument, where + ": datasets must be a list of strings");
  for (const toml::node& item : *list) {
    if (!item.is_string())
      return fail(Errc::invalid_argument, where + ": datasets must be a list of strings");
    config.datasets.push_back(item.as_string()->get());
  }
  return {};
}

Result<void> read_file(Config& config, const std::string& file) {
  toml::table table;
  try {
    table = toml::parse_file(file);
  } catch (const toml::parse_error& error) {
    const bool placed = error.source().begin.line > 0;
    const std::string line =
        placed ? ":" + std::to_string(error.source().begin.line) : std::string();
    return fail(Errc::invalid_argument, file + line + ": " + std::string(error.description()));
  }
  for (const auto& [key, node] : table) {
    const std::string where = file + ":" + std::to_string(node.source().begin.line);
    if (key.str() == "datasets") {
      if (auto done = read_datasets(config, node, where); !done) return done;
      continue;
    }
    const auto setting = std::ranges::find_if(
        settings(), [&](const Setting& row) { return file_key(row.name) == key.str(); });
    if (setting == settings().end())
      return fail(Errc::invalid_argument,
                  fmt::format("{}: unknown key {}{}", where, key.str(),
                              key.str().starts_with("dataset") ? "; did you mean datasets?"
                                                               : suggestion(key.str(), file_key)));
    const auto value = scalar_text(node);
    if (!value)
      return fail(Errc::invalid_argument, where + ": " + setting->name + " must be a plain value");
    if (auto done = set(config, *setting, *value, where); !done) return done;
  }
  return {};
}

}  // namespace

const std::vector<Setting>& settings() {
  static const std::vector<Setting> table = {
      listen_setting(),
      number("threads", "threads for network I/O; 0: one per core", &Config::threads, 0, 1024),
      number("build-threads", "threads that make tiles; 0: one per core", &Config::build_threads, 0,
             1024),
      number("queue", "tiles that may wait to be made before clients get 503", &Config::queue, 0,
             1'000'000),
      number("cache-mb", "memory for finished tiles, megabytes", &Config::cache_mb, 0, 1'000'000),
      number("source-cache-mb", "memory for the DEMs' heights, all together, megabytes",
             &Config::source_cache_mb, 1, 1'000'000),
      choice("from-datum", "what the DEMs' heights are above", &Config::from_datum,
             {"unknown", "egm96", "ellipsoid"}),
      choice("to-datum", "what the tiles' heights are above", &Config::to_datum,
             {"ellipsoid", "same"}),
      nodata_setting(),
      number("max-error", "largest error at the deepest level, metres; 0: 1/32 of the post spacing",
             &Config::max_error, 0.0, 1e6),
      number("error-factor", "scales the error that each coarser level may have",
             &Config::error_factor, 1e-3, 1e3),
      choice("side", "where tiles lie as seen from the DEM's posts", &Config::side),
      number("max-connections", "clients connected at the same time", &Config::max_connections, 1,
             1'000'000),
      number("max-connections-per-address",
             "of these, from one address (IPv6: one /64); 0: a quarter of max-connections",
             &Config::max_connections_per_address, 0, 1'000'000),
      number("buffer-mb", "memory for request bodies and for responses on their way, megabytes",
             &Config::buffer_mb, 64, 1'000'000),
      text("viewer", "folder of the web page; default: beside the program", &Config::viewer),
      text(
          "index-dir",
          "folder for the residual indexes of large DEMs; default: tind in the user's cache folder",
          &Config::index_dir),
      toggle("allow-vrt", "accept VRT files, which can name any other file", &Config::allow_vrt),
      toggle("access-log", "log every request", &Config::access_log),
      choice("log-level", "how much to log", &Config::log_level,
             {"debug", "info", "warn", "error", "off"}),
      number("drain-delay", "seconds of not ready, but serving, before a stop",
             &Config::drain_delay, 0.0, 3600.0),
      number("grace", "seconds that requests in flight have after a stop", &Config::grace, 0.0,
             3600.0),
  };
  return table;
}

std::string default_index_dir() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache)
    return std::string(cache) + "/tind";
  if (const char* home = std::getenv("HOME"); home && *home)
    return std::string(home) + "/.cache/tind";
  return {};
}

Result<Config> read_config(const ConfigInput& input) {
  Config config;
  if (!input.file.empty())
    if (auto done = read_file(config, input.file); !done) return std::unexpected(done.error());
  if (auto done = check_environment(input.environment_names); !done)
    return std::unexpected(done.error());
  for (const Setting& setting : settings()) {
    const std::string key = environment_key(setting.name);
    const auto value = input.environment ? input.environment(key) : std::nullopt;
    if (!value) continue;
    if (auto done = set(config, setting, *value, key); !done) return std::unexpected(done.error());
  }
  for (const Setting& setting : settings()) {
    const auto flag = input.flags.find(setting.name);
    if (flag == input.flags.end()) continue;
    if (auto done = set(config, setting, flag->second, "--" + setting.name); !done)
      return std::unexpected(done.error());
  }
  if (!input.datasets.empty()) config.datasets = input.datasets;
  return config;
}

std::string print_config(const Config& config) {
  std::vector<std::string> datasets;
  for (const std::string& dataset : config.datasets) datasets.push_back(quoted(dataset));
  std::string out = fmt::format("datasets = [{}]\n", fmt::join(datasets, ", "));
  for (const Setting& setting : settings())
    out +=
        fmt::format("{} = {}  # {}\n", file_key(setting.name), setting.show(config), setting.help);
  return out;
}

Result<ListenAddress> parse_listen(std::string_view text) {
  const auto bad = [] {
    return fail(Errc::invalid_argument,
                "must be ADDRESS:PORT, ADDRESS an IP address of this machine");
  };
  ListenAddress listen{"127.0.0.1", 0};
  const auto colon = text.rfind(':');
  std::string_view port = text;
  if (colon != text.npos) {
    std::string_view address = text.substr(0, colon);
    port = text.substr(colon + 1);
    if (address.starts_with('[') && address.ends_with(']')) {
      address = address.substr(1, address.size() - 2);
    } else if (address.find(':') != address.npos) {
      return bad();
    }
    if (address == "localhost") address = "127.0.0.1";
    if (!address.empty()) listen.address = address;
  }
  const auto [stop, error] = std::from_chars(port.data(), port.data() + port.size(), listen.port);
  if (error != std::errc() || stop != port.data() + port.size()) return bad();
  std::array<unsigned char, sizeof(in6_addr)> ignored;
  if (inet_pton(AF_INET, listen.address.c_str(), ignored.data()) != 1 &&
      inet_pton(AF_INET6, listen.address.c_str(), ignored.data()) != 1)
    return bad();
  return listen;
}

}  // namespace tind::services
