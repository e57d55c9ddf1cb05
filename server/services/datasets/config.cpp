#include "server/services/datasets/config.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>

#include "server/services/datasets/key_table.h"
#include "terrain/base/lower_case.h"

namespace tind::services {
namespace {

// --- the kinds of settings -----------------------------------------------------------------------

Setting text(std::string name, std::string help, std::string Config::*field) {
  return {std::move(name), std::move(help), false,
          [field](Config& config, std::string_view value) -> Result<void> {
            config.*field = value;
            return {};
          },
          [field](const Config& config) { return toml_quoted(config.*field); }};
}

Setting choice(std::string name, std::string help, std::string Config::*field,
               std::vector<std::string> values) {
  Setting setting =
      text(std::move(name), fmt::format("{}: {}", help, fmt::join(values, ", ")), field);
  setting.set = [field, values](Config& config, std::string_view value) -> Result<void> {
    if (std::ranges::find(values, value) == values.end())
      return fail(Errc::invalid_argument,
                  fmt::format("must be one of {}", fmt::join(values, ", ")));
    config.*field = value;
    return {};
  };
  return setting;
}

template <class Number>
Setting number(std::string name, std::string help, Number Config::*field, Number low, Number high) {
  return {std::move(name), std::move(help), false,
          [=](Config& config, std::string_view value) -> Result<void> {
            const auto parsed = parse_number(value, low, high);
            if (!parsed) return std::unexpected(parsed.error());
            config.*field = *parsed;
            return {};
          },
          [field](const Config& config) { return fmt::format("{}", config.*field); }};
}

Setting toggle(std::string name, std::string help, bool Config::*field) {
  return {std::move(name), std::move(help), true,
          [field](Config& config, std::string_view value) -> Result<void> {
            const auto on = parse_switch(value);
            if (!on) return std::unexpected(on.error());
            config.*field = *on;
            return {};
          },
          [field](const Config& config) { return std::string(config.*field ? "true" : "false"); }};
}

Setting admin_listen_setting() {
  Setting setting = text("admin-listen",
                         "where to listen for /admin/reload, /metrics and /readyz?verbose: "
                         "127.0.0.1:PORT or unix:/PATH; nowhere without it",
                         &Config::admin_listen);
  setting.set = [](Config& config, std::string_view value) -> Result<void> {
    if (!value.empty())
      if (auto parsed = parse_admin_listen(value); !parsed) return std::unexpected(parsed.error());
    config.admin_listen = value;
    return {};
  };
  return setting;
}

/// What is said here holds for every dataset whose table says nothing else.
Setting of_every_dataset(const DatasetSetting& row) {
  return {row.name, row.help, row.is_switch,
          [&row](Config& config, std::string_view value) -> Result<void> {
            if (value.empty() || value == row.initial) {  // as it is where nobody says anything
              config.every.erase(row.name);
              return {};
            }
            DatasetOptions scratch;
            if (auto done = row.set(scratch, value); !done) return done;
            config.every[row.name] = value;
            return {};
          },
          [&row](const Config& config) {
            const auto said = config.every.find(row.name);
            const std::string& text = said == config.every.end() ? row.initial : said->second;
            return row.is_number || row.is_switch ? text : toml_quoted(text);
          }};
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

std::string environment_key(std::string_view name) {
  std::string key = "TIND_";
  for (const char c : name)
    key += c == '-' ? '_' : char(std::toupper(static_cast<unsigned char>(c)));
  return key;
}

/// `name_of`: how a setting is called where the unknown name was found.
template <class NameOf>
std::string suggestion(std::string_view unknown, NameOf&& name_of) {
  std::vector<std::string> names;
  for (const Setting& setting : settings()) names.push_back(name_of(setting.name));
  const std::string near = did_you_mean(unknown, names);
  return near.empty() ? "; see tind serve --print-config for all" : near;
}

/// Not settings of the daemon: where its data lies, how remote files are asked for, the key
/// with which commands ask a daemon, the program that tests run, and what Kubernetes tells every
/// pod about a service that is called "tind".
bool is_other_variable(std::string_view key) {
  return key == "TIND_DATA" || key == "TIND_REMOTE_TIMEOUT" || key == "TIND_REMOTE_TRIES" ||
         key == "TIND_BINARY" || key == "TIND_KEY" || key == "TIND_PORT" ||
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
    return fail(done.error().code,
                fmt::format("{}: {}", where,
                            wrong_value(setting.name, std::string(value), done.error().what)));
  return {};
}

Result<void> read_datasets(Config& config, const TomlValue& node, const std::string& where) {
  const auto bad = [&] {
    return fail(Errc::invalid_argument, where + ": datasets must be a list of strings");
  };
  if (!node.list()) return bad();
  for (const TomlValue& item : *node.list()) {
    if (!item.is_text) return bad();
    config.datasets.push_back(*item.scalar());
  }
  return {};
}

/// [[dataset]]
Result<void> read_tables(Config& config, const TomlValue& node, const std::string& file) {
  if (node.table())
    return fail(Errc::invalid_argument,
                fmt::format("{}:{}: write [[dataset]], with two brackets", file, node.line));
  if (!node.list() || node.list()->empty())
    return fail(Errc::invalid_argument,
                fmt::format("{}:{}: dataset is for tables, [[dataset]]; did you mean datasets?",
                            file, node.line));
  for (const TomlValue& item : *node.list()) {
    auto spec = read_dataset_table(item, file);
    if (!spec) return std::unexpected(spec.error());
    for (const DatasetSpec& other : config.tables)
      if (!spec->name.empty() && other.name == spec->name)
        return fail(Errc::invalid_argument, fmt::format("{}: a second dataset {}; the first is {}",
                                                        spec->where, spec->name, other.where));
    config.tables.push_back(std::move(*spec));
  }
  return {};
}

/// [[key]]
Result<void> read_keys(Config& config, const TomlValue& node, const std::string& file) {
  if (!node.list() || node.list()->empty())
    return fail(Errc::invalid_argument,
                fmt::format("{}:{}: write [[key]], with two brackets; tind key new prints one",
                            file, node.line));
  std::vector<Key>& keys = config.access.keys;
  for (const TomlValue& item : *node.list()) {
    auto key = read_key_table(item, file);
    if (!key) return std::unexpected(key.error());
    for (const Key& other : keys)
      if (other.name == key->name || other.hash == key->hash)
        return fail(
            Errc::invalid_argument,
            fmt::format("{}: a second key {}; the first is {}", key->where,
                        other.name == key->name ? key->name : "of that sha256", other.where));
    keys.push_back(std::move(*key));
  }
  return {};
}

/// As a flag would have it: one value, or several with commas between.
std::optional<std::string> text_of(const TomlValue& value, const Setting& setting) {
  if (value.scalar()) return *value.scalar();
  const DatasetSetting* const row = dataset_setting(setting.name);
  if (!value.list() || value.list()->empty() || !row || !row->is_list) return std::nullopt;
  std::string text;
  for (const TomlValue& item : *value.list()) {
    if (!item.scalar()) return std::nullopt;
    text += (text.empty() ? "" : ",") + *item.scalar();
  }
  return text;
}

Result<void> read_file(Config& config, const std::string& file) {
  const auto table = read_toml(file);
  if (!table) return std::unexpected(table.error());
  for (const auto& [key, node] : *table) {
    const std::string where = fmt::format("{}:{}", file, node.line);
    if (key == "key") {
      if (auto done = read_keys(config, node, file); !done) return done;
      continue;
    }
    if (key == "datasets" || key == "dataset") {
      auto done =
          key == "dataset" ? read_tables(config, node, file) : read_datasets(config, node, where);
      if (!done) return done;
      continue;
    }
    const auto setting = std::ranges::find_if(
        settings(), [&](const Setting& row) { return file_key(row.name) == key; });
    if (setting == settings().end())
      return fail(Errc::invalid_argument,
                  fmt::format("{}: unknown key {}{}", where, key,
                              key.starts_with("dataset") ? "; did you mean datasets?"
                                                         : suggestion(key, file_key)));
    const auto value = text_of(node, *setting);
    if (!value)
      return fail(Errc::invalid_argument, where + ": " + setting->name + " must be a plain value");
    if (auto done = set(config, *setting, *value, where); !done) return done;
  }
  return {};
}

/// 0, or at least `least`: less than one request would lock everybody out.
Setting rate_setting(std::string name, std::string help, double Rate::*field, double least) {
  return {std::move(name), std::move(help), false,
          [field, least](Config& config, std::string_view value) -> Result<void> {
            const auto parsed = parse_number(value, 0.0, 1e6);
            if (!parsed) return std::unexpected(parsed.error());
            if (*parsed > 0 && *parsed < least)
              return fail(Errc::invalid_argument, fmt::format("is 0, or at least {}", least));
            config.access.per_address.*field = *parsed;
            return {};
          },
          [field](const Config& config) {
            return fmt::format("{}", config.access.per_address.*field);
          }};
}

Setting without_key_setting() {
  return {
      "without-key",
      "what needs no key where there are keys: of tiles, read, jobs, admin, with commas between",
      false,
      [](Config& config, std::string_view value) -> Result<void> {
        auto scopes = scopes_of(value);
        if (!scopes) return std::unexpected(scopes.error());
        config.access.without_a_key = std::move(*scopes);
        return {};
      },
      [](const Config& config) { return toml_quoted(scopes_text(config.access.without_a_key)); }};
}

Setting cors_setting() {
  Setting setting = text("cors-origins",
                         "whose web pages may read answers: * or origins with commas between, "
                         "https://example.org; empty: none",
                         &Config::cors_origins);
  setting.set = [](Config& config, std::string_view value) -> Result<void> {
    if (auto origins = origins_of(value); !origins) return std::unexpected(origins.error());
    config.cors_origins = value;
    return {};
  };
  return setting;
}

Setting hosts_setting() {
  Setting setting = text("hosts",
                         "names under which web pages may ask for jobs, commas between, where the "
                         "daemon listens on this machine alone: those of the proxy before it",
                         &Config::hosts);
  setting.set = [](Config& config, std::string_view value) -> Result<void> {
    for (const std::string& name : hosts_of(value))
      if (name.empty() || name.find_first_of("/: *") != name.npos)
        return fail(Errc::invalid_argument, "'" + name + "' is no name of a host, example.org");
    config.hosts = value;
    return {};
  };
  return setting;
}

std::vector<Setting> make_table() {
  std::vector<Setting> table = {
      text("catalog", "folder of which each file and folder is a dataset; it is followed",
           &Config::catalog),
      listen_setting(),
      admin_listen_setting(),
      number("threads", "threads for network I/O; 0: one per core", &Config::threads, 0, 1024),
      number("build-threads", "threads that make tiles; 0: one per core", &Config::build_threads, 0,
             1024),
      number("queue", "tiles that may wait to be made before clients get 503", &Config::queue, 0,
             1'000'000),
      number("cache-mb", "memory for finished tiles, megabytes", &Config::cache_mb, 0, 1'000'000),
      number("source-cache-mb", "memory for the DEMs' heights, all together, megabytes",
             &Config::source_cache_mb, 1, 1'000'000),
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
      toggle("access-log", "log every request", &Config::access_log),
      toggle("as-root", "serve also as root, which else is refused", &Config::as_root),
      choice("log-level", "how much to log", &Config::log_level,
             {"debug", "info", "warn", "error", "off"}),
      choice("log-format", "how a line of the log looks", &Config::log_format, {"text", "json"}),
      text("jobs-dir",
           "folder that keeps jobs and their results over restarts; without it they end with the "
           "daemon",
           &Config::jobs_dir),
      number("jobs", "jobs that run at a time; 0: no /processes", &Config::jobs, 0, 1024),
      number("jobs-waiting", "jobs that may wait beside them before clients get 503",
             &Config::jobs_waiting, 0, 1'000'000),
      number("jobs-per-client", "jobs of one address that may wait or run",
             &Config::jobs_per_client, 1, 1'000'000),
      number("jobs-memory-mb", "memory that one job may take, megabytes", &Config::jobs_memory_mb,
             64, 10'000'000),
      number("jobs-result-mb", "largest file that one job may make, megabytes",
             &Config::jobs_result_mb, 1, 10'000'000),
      number("jobs-stored-mb", "of all jobs' results together, megabytes", &Config::jobs_stored_mb,
             1, 100'000'000),
      number("jobs-stored-mb-per-client",
             "of one address's results, megabytes; 0: half of jobs-stored-mb",
             &Config::jobs_stored_mb_per_client, 0, 100'000'000),
      number("jobs-seconds", "time that one job may take", &Config::jobs_seconds, 1, 1'000'000),
      number("jobs-kept-hours", "how long results are kept", &Config::jobs_kept_hours, 1,
             1'000'000),
      without_key_setting(),
      rate_setting("rate-per-address",
                   "requests a second of one address (IPv6: one /64) without a key; 0: any number",
                   &Rate::per_second, 1e-3),
      rate_setting("burst-per-address", "of these, at once after a rest; 0: twice the rate",
                   &Rate::burst, 1),
      cors_setting(),
      hosts_setting(),
      number("drain-delay", "seconds of not ready, but serving, before a stop",
             &Config::drain_delay, 0.0, 3600.0),
      number("grace", "seconds that requests in flight have after a stop", &Config::grace, 0.0,
             3600.0),
  };
  const auto after_caches = std::ranges::find(table, "max-connections", &Setting::name);
  std::vector<Setting> of_datasets;
  for (const DatasetSetting& row : dataset_settings())
    if (row.for_all) of_datasets.push_back(of_every_dataset(row));
  table.insert(after_caches, of_datasets.begin(), of_datasets.end());
  return table;
}

}  // namespace

const std::vector<Setting>& settings() {
  static const std::vector<Setting> table = make_table();
  return table;
}

std::string index_dir_of(const std::string& said) {
  if (!said.empty()) return said;
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache && *cache)
    return std::string(cache) + "/tind";
  if (const char* home = std::getenv("HOME"); home && *home)
    return std::string(home) + "/.cache/tind";
  return {};
}

namespace {

/// Settings that say nothing without others, or nothing good.
Result<void> fit_together(const Config& config) {
  if (config.access.per_address.burst > 0 && config.access.per_address.per_second == 0)
    return fail(Errc::invalid_argument,
                "burst-per-address is of rate-per-address, and there is none: set both");
  if (config.jobs > 0 && config.jobs_stored_mb < config.jobs_result_mb)
    return fail(
        Errc::invalid_argument,
        fmt::format("jobs-stored-mb is {} and jobs-result-mb {}: no job could ever keep its "
                    "results; set the first one higher, or the second one lower",
                    config.jobs_stored_mb, config.jobs_result_mb));
  if (const int own = config.jobs_stored_mb_per_client;
      config.jobs > 0 && own > 0 && own < config.jobs_result_mb)
    return fail(Errc::invalid_argument,
                fmt::format("jobs-stored-mb-per-client is {} and jobs-result-mb {}: no job could "
                            "ever keep its results; set the first one higher, or 0 for half of "
                            "jobs-stored-mb",
                            own, config.jobs_result_mb));
  return {};
}

}  // namespace

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
  if (!input.datasets.empty() || !input.tables.empty()) {
    config.datasets = input.datasets;
    config.tables = input.tables;
  }
  if (auto fits = fit_together(config); !fits) return std::unexpected(fits.error());
  return config;
}

std::string print_config(const Config& config) {
  std::vector<std::string> datasets;
  datasets.reserve(config.datasets.size());
  for (const std::string& dataset : config.datasets) datasets.push_back(toml_quoted(dataset));
  std::string out = fmt::format("datasets = [{}]\n", fmt::join(datasets, ", "));
  for (const Setting& setting : settings())
    out +=
        fmt::format("{} = {}  # {}\n", file_key(setting.name), setting.show(config), setting.help);
  for (const DatasetSpec& table : config.tables) out += print_dataset_table(table);
  for (const Key& key : config.access.keys) out += print_key_table(key);
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

Result<AdminAddress> parse_admin_listen(std::string_view text) {
  constexpr std::string_view kUnix = "unix:";
  constexpr std::size_t kMaxSocketPath = 103;  // what the system takes, less what a new one needs
  AdminAddress where;
  if (text.starts_with(kUnix)) {
    where.socket = text.substr(kUnix.size());
    if (where.socket.empty() || where.socket.size() > kMaxSocketPath)
      return fail(Errc::invalid_argument,
                  fmt::format("must have a path of 1 to {} bytes after unix:", kMaxSocketPath));
    return where;
  }
  auto listen = parse_listen(text);
  if (!listen)
    return fail(Errc::invalid_argument, "must be 127.0.0.1:PORT, [::1]:PORT or unix:/PATH");
  if (!listen->address.starts_with("127.") && listen->address != "::1")
    return fail(Errc::invalid_argument,
                "must be an address that only this machine reaches (127.0.0.1, [::1]) or "
                "unix:/PATH: who reaches it may reload the catalog");
  static_cast<ListenAddress&>(where) = std::move(*listen);
  return where;
}

Result<void> something_to_serve(const Config& config) {
  if (!config.datasets.empty() || !config.tables.empty() || !config.catalog.empty()) return {};
  return fail(Errc::invalid_argument,
              "nothing to serve: name a DEM or a directory of tiles (see tind serve --help)");
}

std::vector<std::string> hosts_of(std::string_view text) {
  std::vector<std::string> hosts;
  while (!text.empty()) {
    const std::string_view one = text.substr(0, text.find(','));
    hosts.push_back(lower_case(std::string(one)));
    text.remove_prefix(std::min(one.size() + 1, text.size()));
  }
  return hosts;
}

std::vector<DatasetSpec> specs_of(const Config& config) {
  std::vector<DatasetSpec> specs;
  specs.reserve(config.datasets.size() + config.tables.size());
  for (const std::string& text : config.datasets) specs.push_back(parse_dataset_spec(text));
  specs.insert(specs.end(), config.tables.begin(), config.tables.end());
  return specs;
}

std::vector<std::string> settings_for_restart(const Config& old, const Config& now) {
  std::vector<std::string> names;
  for (const Setting& setting : settings()) {
    const bool taken_over = dataset_setting(setting.name) != nullptr || setting.name == "catalog" ||
                            setting.name == "index-dir" || setting.name == "without-key" ||
                            setting.name == "rate-per-address" ||
                            setting.name == "burst-per-address";
    if (!taken_over && setting.show(old) != setting.show(now)) names.push_back(setting.name);
  }
  return names;
}

}  // namespace tind::services
