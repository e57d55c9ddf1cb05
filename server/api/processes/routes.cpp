// /processes: what can be done as a job, and doing it.

#include <expected>
#include <nlohmann/json.hpp>
#include <utility>

#include "proto/json_text.h"
#include "server/api/processes/area_input.h"
#include "server/api/processes/dem_inputs.h"
#include "server/api/processes/job_json.h"
#include "server/api/processes/list_page.h"
#include "server/api/processes/pages.h"
#include "server/api/processes/process.h"
#include "server/api/processes/process_operations.h"
#include "server/api/processes/results.h"
#include "server/api/tiles/web_map.h"
#include "server/http/message/problem.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;
using services::Job;

constexpr std::size_t kMostBody = 8u << 20;
constexpr std::size_t kQuickly = 10'000;  // bytes
/// Lists of three numbers for all positions of two inputs, or Features of two positions each.
constexpr std::size_t kMostValues = 8 * kMostPositions;
constexpr std::string_view kNoSuchProcess =
    "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/no-such-process";

http::Reply json_reply(int status, const Ordered& json, std::vector<http::Header> fields = {}) {
  fields.push_back({"Cache-Control", "no-store"});
  return http::make_reply(status, "application/json", json::to_text(json, 2) + "\n", fields);
}

Ordered summary_json(const Process& p, const ogc::Asked& asked) {
  const std::string self = asked.url(std::string("/processes/") + p.id);
  return {{"id", p.id},
          {"title", p.title},
          {"description", p.description},
          {"version", TIND_VERSION},
          {"jobControlOptions", {"sync-execute", "async-execute", "dismiss"}},
          {"outputTransmission", {"value", "reference"}},
          {"links",
           {link_json(self, "self", "application/json", "what it takes"),
            link_json(self + "/execution", "http://www.opengis.net/def/rel/ogc/1.0/execute",
                      "application/json", "where it is asked for")}}};
}

http::Reply no_such_process(const http::Request& request) {
  return http::problem_reply({.status = 404,
                              .detail = "There is no such process; /processes lists all.",
                              .instance = request.head.target,
                              .type = kNoSuchProcess});
}

bool prefers_async(const http::Fields& fields) {
  return fields.find("prefer").value_or("").find("respond-async") != std::string_view::npos;
}

/// {"inputs": {...}, "outputs": {...}, "response": "raw"}
std::optional<services::JobOrder> read_order(const App& app, const Process& process,
                                             const Json& json, Problems& problems) {
  Members members(json, "", problems);
  const Json* const inputs = members.member("inputs", Members::Need::must);
  if (inputs && !inputs->is_object()) problems.add("inputs", "must be an object");
  std::optional<services::JobOrder> order;
  if (inputs && inputs->is_object()) {
    auto made = process.order(app, *inputs);
    if (made)
      order = std::move(*made);
    else
      for (const http::ParameterProblem& p : made.error().list())
        problems.add("inputs." + p.parameter, p.detail);
  }
  if (order) {
    read_results(members, *order, problems);
  } else {  // what its outputs are is not known then
    (void)members.member("outputs");
    (void)members.member("response");
  }
  members.nothing_else();
  return order;
}

/// `origin`: origin_of() the request.
http::Reply created(const Job& job, const std::string& origin) {
  const std::string where = "/jobs/" + job.id;
  return json_reply(201, status_json(job, origin),
                    {{"Location", where},
                     {"Preference-Applied", "respond-async"},
                     {"Access-Control-Expose-Headers", "Location, Preference-Applied"}});
}

http::Reply no_room(const Error& error, const std::string& target) {
  // Words about the server's own files are for its log.
  if (error.code == Errc::io)
    return http::problem_reply({.status = 503,
                                .detail = "The server cannot keep jobs at the moment.",
                                .instance = target,
                                .headers = {{"Retry-After", "10"}}},
                               error.what);
  if (error.code != Errc::busy) return http::problem_reply(error, target);
  return http::problem_reply({.status = 503,
                              .detail = error.what + ".",
                              .instance = target,
                              .headers = {{"Retry-After", "10"}}});
}

using Datasets = std::vector<std::shared_ptr<const services::ServedDataset>>;

/// Fails where a dataset's files are not those that all other answers are of, which a job would
/// open anew: old and new never mix.
Result<void> unchanged(const Datasets& datasets) {
  for (const auto& dataset : datasets)
    if (dataset->unchanged)
      if (auto same = dataset->unchanged(); !same) return same;
  return {};
}

std::optional<http::Reply> changed_since(const Datasets& datasets, const std::string& target) {
  if (const auto same = unchanged(datasets); !same)
    return http::problem_reply(same.error(), target);
  return std::nullopt;
}

/// Of a client that waits for the end of its job. One whose results it has is not kept. `origin`:
/// origin_of() its request.
void wait_for(const App& app, const services::JobOrder& order, Datasets datasets,
              http::Responder to, const std::string& target, const std::string& origin) {
  const std::stop_token gone = to.asker().gone;
  const auto waiting = std::make_shared<http::Responder>(std::move(to));
  const auto job = app.jobs->submit(
      order,
      [&app, waiting, document = order.document, datasets = std::move(datasets), target,
       origin](const Job& ended) {
        auto changed = changed_since(datasets, target);  // before it read them, or meanwhile
        http::Reply reply =
            !ended.has_ended()
                ? http::problem_reply(Error{Errc::cancelled, "the daemon stops"}, target)
            : changed ? std::move(*changed)
                      : results_reply(*app.jobs, ended, {}, target, origin);
        if (!document && ended.status == services::JobStatus::successful) app.jobs->forget(ended);
        (*waiting)(std::move(reply));
      },
      gone);
  if (!job) (*waiting)(no_room(job.error(), target));
}

/// Those that inputs name; or the answer to a key that is not for one of them, which is the same
/// whether there is such a dataset or not.
std::expected<Datasets, http::Reply> datasets_of(const App& app, const http::Access* access,
                                                 const Json& json, const std::string& target) {
  Datasets named;
  const auto inputs = json.find("inputs");
  if (inputs == json.end() || !inputs->is_object()) return named;
  for (const char* const input : kDatasetInputs) {
    const auto value = inputs->find(input);
    if (value == inputs->end() || !value->is_string()) continue;
    const auto& name = value->get_ref<const std::string&>();
    if (access && !access->datasets.empty() && !access->sees(name))
      return std::unexpected(http::problem_reply(
          {.status = 403,
           .detail = std::string("The key is not for the dataset of inputs.") + input + ".",
           .instance = target}));
    if (auto dataset = app.catalog.find(name)) named.push_back(std::move(dataset));
  }
  return named;
}

std::optional<http::Reply> execute(const App& app, const Process* process,
                                   const http::Request& request, http::DeferredReply& deferred) {
  // Large ones take tens of milliseconds to read, and others' questions are not to wait for that.
  const auto work =
      request.body.size() < kQuickly ? services::Work::question : services::Work::batch;
  run_on_worker(
      app, work, request.head.target, deferred.responder(),
      [&app, process, async = prefers_async(request.head.fields), body = request.body,
       access = request.access, client = deferred.client(), origin = origin_of(request),
       target = std::string(request.head.target)](http::Responder to, const std::stop_token&) {
        Problems problems;
        const Json json = parse_body(body, kMostValues, problems);
        if (!problems.empty()) return to(http::problem_reply(problems.list(), target));
        auto datasets = datasets_of(app, access.get(), json, target);
        if (!datasets) return to(std::move(datasets.error()));
        auto order = read_order(app, *process, json, problems);
        if (!problems.empty()) return to(http::problem_reply(problems.list(), target));
        order->client = client;
        if (auto reply = changed_since(*datasets, target)) return to(*std::move(reply));
        if (!async)
          return wait_for(app, *order, *std::move(datasets), std::move(to), target, origin);
        const auto job = app.jobs->submit(
            *order, {}, {}, [datasets = *std::move(datasets)] { return unchanged(datasets); });
        to(job ? created(*job, origin) : no_room(job.error(), target));
      });
  return std::nullopt;
}

}  // namespace

std::span<const Process> processes() {
  static const std::vector<Process> kAll = [] {
    std::vector<Process> all = raster_processes();
    all.insert(all.begin(), simplify_process());
    for (const Process& question : question_processes()) all.push_back(question);
    for (const Process& process : {refine_process(), compare_process(), measure_process()})
      all.push_back(process);
    return all;
  }();
  return kAll;
}

const Process* process_named(std::string_view id) {
  for (const Process& p : processes())
    if (id == p.id) return &p;
  return nullptr;
}

void add_process_routes(http::Router& router, const App& app) {
  if (!app.jobs) return;
  router.get("/processes", processes_operation(),
             [](const http::Request& request, http::DeferredReply&) {
               const auto query = http::read_query(request);
               if (!query.problems.empty())
                 return http::problem_reply(query.problems, request.head.target);
               const ListPage page = list_page(query);
               const ogc::Asked asked = ogc::asked_of(request, query.words[0]);
               Ordered json = {{"processes", Ordered::array()}};
               std::size_t found = 0;
               for (const Process& p : processes())
                 if (page.has(found++)) json["processes"].push_back(summary_json(p, asked));
               json["links"] = page_links(asked, page, found);
               return process_list_reply(asked, std::move(json));
             });
  router.get("/processes/{id}", process_operation(),
             [](const http::Request& request, http::DeferredReply&) {
               const Process* const p = process_named(request.matched[0]);
               if (!p) return no_such_process(request);
               const auto asked = ogc::read_asked(request);
               if (!asked) return asked.error();
               Ordered json = summary_json(*p, *asked);
               json["inputs"] = p->inputs();
               json["outputs"] = p->outputs();
               return process_reply(*asked, std::move(json));
             });
  for (const Process& p : processes())
    router.post("/processes/" + std::string(p.id) + "/execution", execute_operation(p),
                {.max_bytes = kMostBody},
                [&app, &p](const http::Request& request, http::DeferredReply& deferred) {
                  return execute(app, &p, request, deferred);
                });
  // That is none.
  router.post(
      "/processes/{id}/execution", no_process_operation(), {.max_bytes = kMostBody},
      [](const http::Request& request, http::DeferredReply&) { return no_such_process(request); });
}

}  // namespace tind::api
