#pragma once
// What the routes of processes say of themselves, from the rows of processes.

#include <vector>

#include "server/api/processes/process.h"
#include "server/http/operation.h"

namespace tind::api {

http::Operation processes_operation();
http::Operation process_operation();
/// Of one process: its inputs as its description has them.
http::Operation execute_operation(const Process&);
/// Of the path of any other.
http::Operation no_process_operation();

/// A job's results as they are sent: a file of one of these types, or a document.
std::vector<http::Response> result_responses();

}  // namespace tind::api
