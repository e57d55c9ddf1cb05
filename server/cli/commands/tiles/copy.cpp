// tind copy: a tile set from one store into another.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "proto/json_text.h"
#include "server/cli/commands/commands.h"
#include "server/cli/options/output_options.h"
#include "server/cli/options/output_paths.h"
#include "server/cli/program/interrupt.h"
#include "server/cli/program/progress_bar.h"
#include "terrain/store/copy/copy_store.h"
#include "terrain/store/open/open_store.h"

namespace tind::cli {

namespace {

struct Arguments {
  std::string from, to, progress = "auto";
  CopyOptions options;
  bool json = false;
};

/// A name of a file of another kind is a slip of the pen, and no folder's.
Result<void> check_name(const std::string& to) {
  static constexpr std::string_view kOthers[] = {".zip", ".tar", ".gz",  ".tgz",
                                                 ".7z",  ".3tz", ".tpm", ".sqlite"};
  const auto ends = [&](std::string_view ending) { return to.ends_with(ending); };
  std::error_code none;
  if (std::ranges::none_of(kOthers, ends) || std::filesystem::is_directory(to, none)) return {};
  return fail(Errc::invalid_argument,
              to + ": tiles are copied into a directory, X.pmtiles or X.mbtiles");
}

int run(const Arguments& a) {
  if (!names_store(a.from)) return complain(no_store(a.from));
  if (!names_archive(a.to))
    if (auto ok = check_name(a.to); !ok) return complain(ok.error());
  if (const int code = check_store_output(a.to); code != kOk) return code;
  finish_on_signals();
  const auto begin = std::chrono::steady_clock::now();
  Result<CopyReport> report = fail(Errc::internal, "not run");
  {
    ProgressBar bar("tiles", progress_style(a.progress));
    report = copy_store(*open_store(a.from), a.to, a.options, stoppable(bar));
  }
  if (!report) return complain(report.error());
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (a.json) {
    const nlohmann::ordered_json j = {{"tiles", report->tiles},
                                      {"kept", report->kept},
                                      {"bytes", report->bytes},
                                      {"unvouched", report->unvouched},
                                      {"seconds", seconds}};
    fmt::print("{}\n", json::to_text(j, 1));
    return kOk;
  }
  fmt::print("{}: {} tiles ({} kept), {} bytes, in {}\n", a.to, report->tiles, report->kept,
             report->bytes, duration_text(seconds));
  if (report->unvouched > 0)
    fmt::print(
        "{} keeps no hashes of {} of them: that they are as they were written, nobody says\n",
        a.from, report->unvouched);
  return kOk;
}

}  // namespace

void add_copy(Command program, int& exit) {
  auto a = std::make_shared<Arguments>();
  Command c = program.add_subcommand(
      "copy",
      "Copy a tile set into a directory, a PMTiles archive, an MBTiles database or object storage");
  c.add_option(
       "FROM", a->from,
       "a directory of tiles, X.pmtiles, X.mbtiles, s3://BUCKET/PREFIX, s3://BUCKET/X.pmtiles, "
       "or a server's URL (its key in TIND_KEY)")
      .required();
  c.add_option("TO", a->to,
               "a directory, X.pmtiles, X.mbtiles, s3://BUCKET/PREFIX or s3://BUCKET/X.pmtiles")
      .required();
  c.add_flag("--force", a->options.force,
             "replace tiles that tind made of another source or with other options; nothing else "
             "is touched");
  c.add_option("--threads", a->options.threads,
               "threads to use, 0: one per core; eight where tiles come from a server or "
               "go to one")
      .not_negative()
      .shown();
  add_progress_option(c, a->progress);
  c.add_flag("--json", a->json, "print the summary as JSON");
  c.footer(
      "An archive has its name only when it is whole. Into a directory or a prefix a copy that was "
      "killed goes "
      "on, and a copy of newer tiles replaces those that differ, all at once.");
  c.on_run([a, &exit] { exit = run(*a); });
}

}  // namespace tind::cli
