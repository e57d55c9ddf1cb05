// tind key new: a key for a client of a daemon. The daemon's file gets its hash, the client the
// key, which nobody can print again.

#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/services/datasets/key_table.h"

namespace tind::cli {
namespace {

struct Options {
  std::string action, name;
  std::vector<std::string> scopes, datasets;
  double rate = 0, burst = 0;
  std::string expires;
  bool json = false;
};

/// As a table has it: said once, checked once.
Result<services::Key> key_of(const Options& options, const std::string& secret) {
  const auto text = [](const std::string& one) {
    return services::TomlValue{.line = 1, .is_text = true, .value = one};
  };
  const auto list = [&](const std::vector<std::string>& all) {
    services::TomlValue::List items;
    for (const std::string& one : all) items.push_back(text(one));
    return services::TomlValue{.line = 1, .is_text = false, .value = std::move(items)};
  };
  const auto number = [](double value) {
    return services::TomlValue{.line = 1, .is_text = false, .value = fmt::format("{}", value)};
  };
  services::TomlValue::Table table = {{"name", text(options.name)},
                                      {"sha256", text(hex_of(sha256(secret)))},
                                      {"scopes", list(options.scopes)}};
  if (!options.datasets.empty()) table.push_back({"datasets", list(options.datasets)});
  if (options.rate > 0) table.push_back({"rate", number(options.rate)});
  if (options.burst > 0) table.push_back({"burst", number(options.burst)});
  if (!options.expires.empty()) table.push_back({"expires", text(options.expires)});
  auto key =
      services::read_key_table({.line = 1, .is_text = false, .value = std::move(table)}, "key new");
  if (!key && key.error().what.starts_with("key new:1: "))
    return fail(key.error().code, key.error().what.substr(11));
  return key;
}

int make_key(const Options& options) {
  const auto secret = services::make_secret();
  if (!secret) return complain(secret.error());
  const auto key = key_of(options, *secret);
  if (!key) return complain(key.error());
  if (key->expires && *key->expires <= std::chrono::system_clock::now())
    return complain({Errc::invalid_argument, "expires is in the past: no request would pass"});
  const std::string table = services::print_key_table(*key);
  if (options.json) {
    std::printf("%s\n", json::to_text(nlohmann::ordered_json{{"name", key->name},
                                                             {"key", *secret},
                                                             {"sha256", hex_of(key->hash)},
                                                             {"toml", table}},
                                      2)
                            .c_str());
    return kOk;
  }
  fmt::print(
      "The key, for the client; it is shown this once:\n\n  {}\n\nFor the file of tind serve "
      "--config:\n{}",
      *secret, table);
  return kOk;
}

}  // namespace

void add_key(Command program, int& exit) {
  Command make = program.add_subcommand(
      "key", "Make a key for a client of a daemon: the secret, and the table with its hash");
  const auto options = std::make_shared<Options>();
  make.add_option("action", options->action, "what to do: new").required().one_of({"new"});
  make.add_option("name", options->name, "whose it is: for logs and jobs").required();
  make.add_option("--scopes", options->scopes, "what it may ask: tiles, read, jobs, admin")
      .delimiter(',')
      .required();
  make.add_option("--datasets", options->datasets, "of which datasets; all without it")
      .delimiter(',');
  make.add_option("--rate", options->rate, "requests a second; any number without it").positive();
  make.add_option("--burst", options->burst, "of these, at once after a rest; twice the rate")
      .positive();
  make.add_option("--expires", options->expires, "the last day: 2027-01-31, or a time with Z");
  make.add_flag("--json", options->json, "as JSON");
  make.footer("Example: tind key new ann --scopes tiles,read --datasets alps --rate 20");
  make.on_run([options, &exit] { exit = make_key(*options); });
}

}  // namespace tind::cli
