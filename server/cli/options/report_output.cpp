#include "server/cli/options/report_output.h"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "proto/json_text.h"
#include "server/cli/options/output_options.h"
#include "server/cli/program/exit.h"
#include "terrain/base/file_io.h"

namespace tind::cli {

void add_report_options(Command app, ReportOutput& output) {
  add_json_flag(app, output.json);
  app.add_option("--report", output.path, "also writes the figures as JSON to this file");
}

int put_report(const ReportOutput& output, const nlohmann::ordered_json& report,
               const std::function<void()>& print) {
  const std::string text = json::to_text(report, 2) + "\n";
  if (!output.path.empty())
    if (const auto ok = write_whole_file(output.path, text); !ok) return complain(ok.error());
  if (output.json)
    std::fwrite(text.data(), 1, text.size(), stdout);
  else
    print();
  return kOk;
}

}  // namespace tind::cli
