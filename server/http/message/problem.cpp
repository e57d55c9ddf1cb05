#include "server/http/message/problem.h"

#include <spdlog/spdlog.h>

#include <atomic>
#include <nlohmann/json.hpp>
#include <random>

#include "server/http/message/escape.h"
#include "server/log/log_limiter.h"

namespace tind::http {
namespace {

/// Unique within a fleet with near certainty: 64 random bits of this process, mixed with a counter.
std::string new_request_id() {
  static const std::uint64_t process =
      (std::uint64_t(std::random_device{}()) << 32) | std::random_device{}();
  static std::atomic<std::uint64_t> next{0};
  std::uint64_t id = process + next.fetch_add(1, std::memory_order_relaxed) * 0x9e3779b97f4a7c15u;
  id = (id ^ (id >> 30)) * 0xbf58476d1ce4e5b9u;
  id = (id ^ (id >> 27)) * 0x94d049bb133111ebu;
  return fmt::format("{:016x}", id ^ (id >> 31));
}

struct Row {
  Errc code;
  int status;
  const char* detail;  // what a client is told; null: the error's own words
};

constexpr Row kTable[] = {
    {Errc::invalid_argument, 400, nullptr},
    {Errc::out_of_range, 400, nullptr},
    {Errc::not_found, 404, "There is no such resource."},
    {Errc::bad_data, 500, "The source of this resource is damaged."},
    {Errc::io, 503, "The source of this resource cannot be read at the moment."},
    {Errc::unsupported, 422, "This cannot be done with this resource."},
    {Errc::busy, 503, "Too much work is waiting; try again soon."},
    {Errc::cancelled, 503, "The server is shutting down."},
    {Errc::internal, 500, "Something is wrong inside the server."},
};

const Row& row_of(Errc code) {
  for (const Row& row : kTable)
    if (row.code == code) return row;
  return kTable[std::size(kTable) - 1];
}

std::string document(const Problem& problem, const std::string& id) {
  nlohmann::ordered_json json;
  json["type"] = problem.type;
  json["title"] = reason(problem.status);
  json["status"] = problem.status;
  json["detail"] = problem.detail;
  if (!problem.instance.empty()) json["instance"] = problem.instance;
  if (!problem.errors.empty()) {
    for (const ParameterProblem& error : problem.errors)
      json["errors"].push_back({{"parameter", error.parameter}, {"detail", error.detail}});
  }
  json["requestId"] = id;
  return json.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

/// One damaged tile that everybody asks for must not fill the disk.
void log_failure(const Problem& problem, std::string_view cause, const std::string& id) {
  static logging::LogLimiter limiter(std::chrono::seconds(5), 64);
  const auto unsaid = limiter.take(cause);
  if (!unsaid) return;
  spdlog::error("{} {}: {} request={}{}", problem.status, escaped(problem.instance), escaped(cause),
                id,
                *unsaid > 0 ? fmt::format(" ({} more were not logged)", *unsaid) : std::string());
}

/// `cause`: what the log is told of a 5xx, which may name files.
Reply reply_with(const Problem& problem, std::string_view cause) {
  const std::string id = new_request_id();
  std::vector<Header> headers = problem.headers;
  headers.push_back({"Cache-Control", "no-store"});
  if (!cause.empty()) log_failure(problem, cause, id);
  Reply reply =
      make_reply(problem.status, "application/problem+json", document(problem, id), headers);
  reply.request_id = id;
  return reply;
}

}  // namespace

int status_of(Errc code) { return row_of(code).status; }

Reply problem_reply(const Problem& problem) {
  return reply_with(problem, problem.status == 500 ? problem.detail : std::string());
}

Reply problem_reply(const Problem& problem, std::string_view cause) {
  return reply_with(problem, cause);
}

Reply problem_reply(const Error& error, std::string_view instance) {
  const Row& row = row_of(error.code);
  Problem problem{.status = row.status,
                  .detail = row.detail ? std::string(row.detail) : error.what,
                  .instance = instance};
  if (row.status == 503) problem.headers.push_back({"Retry-After", "1"});
  const bool expected = error.code == Errc::busy || error.code == Errc::cancelled;
  return reply_with(problem, row.status >= 500 && !expected ? error.what : std::string());
}

Reply problem_reply(const std::vector<ParameterProblem>& problems, std::string_view instance) {
  return problem_reply(
      {.status = 400,
       .detail = "A parameter is wrong: " + problems[0].parameter + " " + problems[0].detail + ".",
       .instance = instance,
       .errors = problems});
}

}  // namespace tind::http
