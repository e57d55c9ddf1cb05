#pragma once
// A job as OGC API - Processes, Part 1, shows it to clients.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "server/services/jobs/jobs.h"

namespace tind::api {

/// "2026-11-23T18:30:45.123Z"
std::string time_text(std::int64_t ms);

/// What the job's program has said last, in the words of requests: "--max-error" is the input
/// max_error, and an option that no input is, but a setting of the dataset, is called that.
std::string message_of(const services::Job&);

/// statusInfo: jobID, processID, type, status, message, progress, times, links. `origin`: what the
/// addresses of its links begin with, origin_of() the request.
nlohmann::ordered_json status_json(const services::Job&, const std::string& origin);

/// A link, as {href, rel, type, title}; the address as it is given.
nlohmann::ordered_json link_json(const std::string& href, const char* rel, const std::string& type,
                                 const std::string& title = {});

}  // namespace tind::api
