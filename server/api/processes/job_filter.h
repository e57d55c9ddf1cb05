#pragma once
// Which jobs a list is of: the parameters of OGC API - Processes, Part 1, class `job-list`.

#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "server/http/message/query_numbers.h"
#include "server/services/jobs/job.h"

namespace tind::api {

struct JobFilter {
  std::set<std::string, std::less<>> processes, statuses;  // empty: all
  bool of_processes = true;  // `type`: other work than processes is none
  /// `datetime`: when it was created, both ends included.
  std::int64_t from_ms = 0, to_ms = std::numeric_limits<std::int64_t>::max();
  /// Of the time that it ran, or has been running.
  double least_s = 0, most_s = std::numeric_limits<double>::infinity();

  bool has(const services::Job&, std::int64_t now_ms) const;
};

/// The rows of an operation's query that job_filter() reads: the last two of its numbers, and its
/// words.
std::vector<http::QueryNumber> job_filter_numbers();
std::vector<http::QueryWord> job_filter_words();
JobFilter job_filter(const http::QueryNumbers&);

}  // namespace tind::api
