#pragma once
// What the daemon does for clients as a job: one row a process, one file each. A process is what a
// subcommand of tind does, run as that, with what a client may say turned into its options.

#include <expected>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "server/api/app.h"
#include "server/api/members.h"
#include "server/services/jobs/jobs.h"

namespace tind::api {

struct Process {
  const char* id;
  const char* title;
  const char* description;
  /// Members by name: {title, description, minOccurs, schema}, as OGC API - Processes, Part 1
  /// describes inputs; outputs alike.
  nlohmann::ordered_json (*inputs)();
  nlohmann::ordered_json (*outputs)();
  /// From what was sent to what is to be run. Every problem names its input. On a worker: a datum's
  /// grid may have to be read.
  std::expected<services::JobOrder, Problems> (*order)(const App&, const Json& inputs);
};

std::span<const Process> processes();
/// Null where there is none of that name.
const Process* process_named(std::string_view id);

// The rows.
Process simplify_process();
Process refine_process();
Process compare_process();
Process measure_process();
std::vector<Process> raster_processes();
std::vector<Process> question_processes();

}  // namespace tind::api
