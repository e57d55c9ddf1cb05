// /jobs: what was asked for, how far it is, what came of it, and that it is not wanted any more.

#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>

#include "proto/json_text.h"
#include "server/api/app.h"
#include "server/api/openapi/openapi_parts.h"
#include "server/api/processes/job_filter.h"
#include "server/api/processes/job_json.h"
#include "server/api/processes/list_page.h"
#include "server/api/processes/pages.h"
#include "server/api/processes/process_operations.h"
#include "server/api/processes/results.h"
#include "server/api/responses.h"
#include "server/http/message/problem.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;
using services::Job;

constexpr std::size_t kMostListed = 100'000;  // before they are filtered
constexpr std::string_view kNoSuchJob =
    "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/no-such-job";

http::Reply json_reply(const Ordered& json) {
  return http::make_reply(200, "application/json", json::to_text(json, 2) + "\n",
                          {{"Cache-Control", "no-store"}});
}

/// What is done with the job of the path, on a worker: jobs are on a disk.
using WithJob = http::Reply (*)(const App&, const Job&, const std::string& output,
                                const ogc::Asked&);

/// Asked for with a key, it is of who shows that key; a key has no job of anybody else.
bool is_of(const Job& job, const std::string& whose) {
  return job.client == whose || (whose.empty() && !job.client.starts_with("key "));
}

std::optional<http::Reply> with_job(const App& app, const http::Request& request,
                                    http::DeferredReply& deferred, WithJob answer) {
  const std::string whose = request.access ? deferred.client() : std::string();
  const auto query = http::read_query(request);
  if (!query.problems.empty()) return http::problem_reply(query.problems, request.head.target);
  return answer_on_worker(
      app, services::Work::question, request, deferred,
      [&app, answer, whose, id = std::string(request.matched[0]),
       output = std::string(request.matched[1]),
       asked = ogc::asked_of(request, query.words.empty() ? "" : query.words[0])](
          const std::stop_token&) {
        const auto job = app.jobs->find(id);
        if (!job) return http::problem_reply(job.error(), asked.target);
        if (!*job || !is_of(**job, whose))
          return http::problem_reply({.status = 404,
                                      .detail = "There is no such job, or it has expired.",
                                      .instance = asked.target,
                                      .type = kNoSuchJob});
        return answer(app, **job, output, asked);
      });
}

std::optional<http::Reply> list_jobs(const App& app, const http::Request& request,
                                     http::DeferredReply& deferred) {
  const auto query = http::read_query(request);
  if (!query.problems.empty()) return http::problem_reply(query.problems, request.head.target);
  return answer_on_worker(
      app, services::Work::question, request, deferred,
      [&app, client = deferred.client(), page = list_page(query), filter = job_filter(query),
       asked = ogc::asked_of(request, query.words.back())](const std::stop_token&) {
        const auto jobs = app.jobs->of_client(client, kMostListed);
        if (!jobs) return http::problem_reply(jobs.error(), asked.target);
        const auto now = std::chrono::duration_cast<std::chrono::milliseconds>(
            std::chrono::system_clock::now().time_since_epoch());
        Ordered json = {{"jobs", Ordered::array()}};
        std::size_t found = 0;
        for (const Job& job : *jobs)
          if (filter.has(job, now.count()) && page.has(found++))
            json["jobs"].push_back(status_json(job, asked.origin));
        json["links"] = page_links(asked, page, found);
        return job_list_reply(asked, std::move(json));
      });
}

constexpr const char* kJobs = R"({
  "type": "object",
  "required": ["jobs", "links"],
  "properties": {"jobs": {"type": "array", "items": {"$ref": "#/components/schemas/Job"}},
                 "links": {"type": "array", "items": {"$ref": "#/components/schemas/Link"}}}})";

http::Operation operation_of(const char* id, const char* summary,
                             std::vector<http::Response> responses) {
  return {.id = id,
          .tag = "Processes",
          .summary = summary,
          .scope = http::Scope::jobs,
          .heeds_access = true,  // with_job() does
          .ignores_others = true,
          .path = {{"job", "the id of a job, as Location said it",
                    R"({"type": "string", "pattern": "^[0-9a-f]{32}$"})"},
                   {"output", "the name of an output", R"({"type": "string"})", R"("mesh")"}},
          .responses = std::move(responses)};
}

http::Operation jobs_operation() {
  http::Operation operation = operation_of("getJobs", "The jobs of who asks",
                                           json_answer("They, the newest first.", kJobs));
  operation.numbers = page_numbers();
  for (const http::QueryNumber& number : job_filter_numbers()) operation.numbers.push_back(number);
  operation.words = job_filter_words();
  return with_page(std::move(operation));
}

http::Operation job_operation() {
  return with_page(operation_of("getJob", "How far a job is", json_answer("It.", kJobRef)));
}

/// What came of a job: files of the formats that processes write, or JSON.
std::vector<http::Response> results() {
  std::vector<http::Response> all = result_responses();
  all.push_back({206, "A range of it.", {{"application/octet-stream"}}});
  all.push_back({304, "The client has it already (If-None-Match)."});
  all.push_back({416, "A range beyond the end."});
  return all;
}

}  // namespace

void add_job_routes(http::Router& router, const App& app) {
  if (!app.jobs) return;
  const auto get = [&](const char* path, http::Operation operation, WithJob answer) {
    router.get(path, std::move(operation),
               [&app, answer](const http::Request& request, http::DeferredReply& deferred) {
                 return with_job(app, request, deferred, answer);
               });
  };
  router.get("/jobs", jobs_operation(),
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return list_jobs(app, request, deferred);
             });
  get("/jobs/{job}", job_operation(),
      [](const App&, const Job& job, const std::string&, const ogc::Asked& asked) {
        return job_reply(asked, status_json(job, asked.origin), job.has_ended());
      });
  get("/jobs/{job}/results", operation_of("getJobResults", "What came of a job", results()),
      [](const App& a, const Job& job, const std::string&, const ogc::Asked& asked) {
        return results_reply(*a.jobs, job, asked.client, asked.target, asked.origin);
      });
  get("/jobs/{job}/results/{output}",
      operation_of("getJobResult", "One output of a job", results()),
      [](const App& a, const Job& job, const std::string& output, const ogc::Asked& asked) {
        return result_reply(*a.jobs, job, output, asked.client, asked.target);
      });
  router.del("/jobs/{job}",
             operation_of("dismissJob", "Stops a job and drops its files",
                          json_answer("As it is now.", kJobRef)),
             [&app](const http::Request& request, http::DeferredReply& deferred) {
               return with_job(
                   app, request, deferred,
                   [](const App& a, const Job& job, const std::string&, const ogc::Asked& asked) {
                     const auto gone = a.jobs->dismiss(job.id);
                     if (!gone) return http::problem_reply(gone.error(), asked.target);
                     return json_reply(status_json(*gone ? **gone : job, asked.origin));
                   });
             });
}

}  // namespace tind::api
