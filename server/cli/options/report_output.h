#pragma once
// What an analysis found, for a person or a program: text, or JSON on standard output, and JSON in
// a file.

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "server/cli/program/command_line.h"

namespace tind::cli {

struct ReportOutput {
  bool json = false;
  std::string path;  // empty: no file
};

/// --json and --report.
void add_report_options(Command, ReportOutput&);

/// `print`: the same for a person. kOk, or says that the file cannot be written and returns its
/// code.
int put_report(const ReportOutput&, const nlohmann::ordered_json&,
               const std::function<void()>& print);

}  // namespace tind::cli
