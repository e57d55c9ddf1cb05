#pragma once
// What the operator wants: read once, checked in one place, then passed on in parts.
// A flag wins over the environment (TIND_CACHE_MB), which wins over the file (cache_mb = 64, TOML),
// which wins over the default.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/services/access/keys.h"
#include "server/services/datasets/dataset_spec.h"
#include "terrain/base/result.h"

namespace tind::services {

struct Config {
  std::vector<std::string> datasets;  // "alps=a.tif,b.tif", as on the command line
  std::vector<DatasetSpec> tables;    // [[dataset]]
  SettingTexts every;                 // what holds for all datasets, by name in dataset_settings()
  std::string catalog;                // a folder of datasets; empty: none
  std::string listen = "127.0.0.1:8080";
  std::string admin_listen;  // "127.0.0.1:8081", "unix:/run/tind.sock"; empty: nowhere
  int threads = 0;           // I/O; 0: one per core
  int build_threads = 0;     // CPU work; 0: one per core
  int queue = 256;
  int cache_mb = 128;  // finished tiles
  int source_cache_mb =
      48;  // heights of all DEMs together: a tile of 2.5 million posts reads its posts thrice
  int max_connections = 4096;
  int max_connections_per_address = 0;  // 0: a quarter of these
  int buffer_mb = 128;                  // request bodies, responses on their way
  std::string viewer;
  std::string index_dir;  // as index_dir_of() takes it
  bool access_log = false;
  bool as_root = false;
  std::string log_level = "info", log_format = "text";
  std::string jobs_dir;  // empty: a temporary one
  int jobs = 1;          // that run at a time; 0: none at all
  int jobs_waiting = 64;
  int jobs_per_client = 8;            // waiting or running
  int jobs_memory_mb = 2048;          // of each
  int jobs_result_mb = 512;           // of each
  int jobs_stored_mb = 4096;          // of all
  int jobs_stored_mb_per_client = 0;  // 0: half of these, and one result at least
  int jobs_seconds = 600;             // of each
  int jobs_kept_hours = 24;           // after their end
  AccessRules access;                 // [[key]], and how often one may ask
  std::string cors_origins = "*";     // whose pages may read answers, with commas between
  std::string hosts;                  // its names, for web pages, with commas between
  double drain_delay = 0;             // seconds
  double grace = 10;                  // seconds
};

/// One row of the table of settings: how it is called, what it means, how it is set and shown.
struct Setting {
  std::string name;  // "cache-mb"; in the file cache_mb, in the environment TIND_CACHE_MB
  std::string help;
  bool is_switch = false;  // a flag without a value
  std::function<Result<void>(Config&, std::string_view)> set;
  std::function<std::string(const Config&)> show;  // as a TOML value
};

/// Every setting but the datasets, which are arguments (`datasets = [...]` and [[dataset]] in the
/// file). Those of all datasets are the rows of dataset_settings().
const std::vector<Setting>& settings();

struct ConfigInput {
  std::string file;  // empty: none
  std::function<std::optional<std::string>(const std::string&)> environment;
  std::vector<std::string> environment_names =
      {};                                    // all there are: one TIND_... unknown is an error
  std::map<std::string, std::string> flags;  // by setting name
  std::vector<std::string> datasets;         // when not empty: instead of all of the file's
  std::vector<DatasetSpec> tables = {};      // the same: datasets of layers
};

/// The first error names where it is and, for an unknown key, what was probably meant.
Result<Config> read_config(const ConfigInput&);

/// Where residual indexes are kept: as said, or, where nothing is, in "tind" in the user's cache
/// folder; empty where there is none.
std::string index_dir_of(const std::string& said);

/// As a file that read_config accepts.
std::string print_config(const Config&);

/// "127.0.0.1:8080", "[::1]:8080", ":8080" (127.0.0.1), "8080".
struct ListenAddress {
  std::string address;
  std::uint16_t port = 0;
};
Result<ListenAddress> parse_listen(std::string_view);

/// The same of this machine alone, or "unix:/run/tind.sock".
struct AdminAddress : ListenAddress {
  std::string socket;  // its path; empty: address and port
};
Result<AdminAddress> parse_admin_listen(std::string_view);

/// The error says that the configuration names nothing.
Result<void> something_to_serve(const Config&);

/// Everything that is to be served, but the catalog's folder.
std::vector<DatasetSpec> specs_of(const Config&);
/// "a.example,B.example" in small letters.
std::vector<std::string> hosts_of(std::string_view text);

/// Names of settings that differ and that a running daemon cannot take over.
std::vector<std::string> settings_for_restart(const Config& old, const Config& now);

}  // namespace tind::services
