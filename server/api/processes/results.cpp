#include "server/api/processes/results.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "proto/json_text.h"
#include "server/api/processes/job_json.h"
#include "server/http/message/byte_range.h"
#include "server/http/message/negotiate.h"
#include "server/http/message/problem.h"
#include "server/http/message/representation.h"
#include "terrain/base/file_io.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;
using services::Job;
using services::JobOrder;
using services::JobStatus;

constexpr std::string_view kNotReady =
    "http://www.opengis.net/def/exceptions/ogcapi-processes-1/1.0/result-not-ready";

/// A file's bytes where the system has them. It may be removed meanwhile, and is never changed.
struct MappedFile {
  http::Payload payload;             // none of its own: what a piece has to name
  services::LentResults::Loan loan;  // of its job
  void* at = nullptr;
  std::size_t size = 0;

  MappedFile() = default;
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  ~MappedFile() {
    if (at) ::munmap(at, size);
  }
  std::string_view bytes() const { return {static_cast<const char*>(at), size}; }
};

std::shared_ptr<MappedFile> map_file(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe is none
  if (file < 0) return nullptr;
  auto mapped = std::make_shared<MappedFile>();
  struct stat facts {};
  if (::fstat(file, &facts) == 0 && S_ISREG(facts.st_mode) && facts.st_size > 0) {
    mapped->size = std::size_t(facts.st_size);
    void* const at = ::mmap(nullptr, mapped->size, PROT_READ, MAP_PRIVATE, file, 0);
    if (at == MAP_FAILED)
      mapped->size = 0;
    else
      mapped->at = at;
  }
  ::close(file);
  return mapped->at ? mapped : nullptr;
}

http::Reply lost(std::string_view target) {
  return http::problem_reply(
      {.status = 503, .detail = "The result cannot be read at the moment.", .instance = target});
}

/// Nothing where the job's files are as it made them.
std::optional<http::Reply> refuse_damaged(const services::Jobs& jobs, const Job& job,
                                          std::string_view target) {
  const auto whole = jobs.is_whole(job);
  if (!whole) return lost(target);
  if (*whole) return std::nullopt;
  return http::problem_reply(
      {.status = 500,
       .detail = "The result is not as the job made it; execute the process again.",
       .instance = target});
}

http::Reply file_reply(const services::Jobs& jobs, const Job& job, const JobOrder::Output& output,
                       const http::Conditions& client, std::string_view target) {
  const std::string etag = "\"" + job.id + "-" + output.name + "\"";
  const std::string name = "attachment; filename=\"" + output.file + "\"";
  std::vector<http::Header> headers = {
      {"ETag", etag},
      {"Cache-Control", "private, no-cache"},
      {"Accept-Ranges", "bytes"},
      {"Content-Disposition", name},
      {"Access-Control-Expose-Headers", "Accept-Ranges, Content-Disposition, Content-Range, ETag"}};
  if (client.excludes(etag)) return http::changed(target);
  if (!client.none_match.empty() && http::lists_etag(client.none_match, etag))
    return http::make_reply(304, output.media_type, {}, headers);
  auto loan = jobs.lend(job);  // first: who removes it now knows of us
  const auto file = map_file(jobs.path_of(job, output));
  if (!file) return lost(target);
  file->loan = std::move(loan);
  const std::shared_ptr<const http::Payload> owner(file, &file->payload);
  using Kind = http::AskedRange::Kind;
  http::AskedRange range;
  if (!client.range.empty() && (client.if_range.empty() || client.if_range == etag))
    range = http::asked_range(client.range, file->size);
  if (range.kind == Kind::beyond) {
    const std::string there = "bytes */" + std::to_string(file->size);
    return http::problem_reply(
        {.status = 416,
         .detail = "The result has " + std::to_string(file->size) + " bytes.",
         .instance = target,
         .headers = {{"Content-Range", there}}});
  }
  if (range.kind == Kind::whole)
    return http::make_reply(output.media_type, {{owner, file->bytes()}}, headers);
  const std::string where = "bytes " + std::to_string(range.first) + "-" +
                            std::to_string(range.first + range.count - 1) + "/" +
                            std::to_string(file->size);
  headers.push_back({"Content-Range", where});
  auto reply = http::make_reply(output.media_type,
                                {{owner, file->bytes().substr(range.first, range.count)}}, headers);
  reply.status = 206;
  return reply;
}

/// Wherever one of the daemon's files is named.
void name_datasets(Ordered& json, const JobOrder& order) {
  if (json.is_structured()) {
    for (Ordered& part : json) name_datasets(part, order);
    return;
  }
  if (!json.is_string()) return;
  for (const auto& [path, name] : order.names)
    if (json.get_ref<const std::string&>() == path) {
      json = name;
      return;
    }
}

/// Each once; what is no dataset is a file of the order.
Ordered datasets_of(const Ordered& named, const JobOrder& order) {
  Ordered once = Ordered::array();
  for (const Ordered& one : named)
    if (std::ranges::find(once, one) == once.end() &&
        std::ranges::any_of(order.names, [&](const auto& name) { return one == name.second; }))
      once.push_back(one);
  return once;
}

/// A report as a client may see it: without the daemon's paths.
Result<Ordered> report_of(const services::Jobs& jobs, const Job& job, const JobOrder& order,
                          const JobOrder::Output& output) {
  auto text = read_whole_file(jobs.path_of(job, output));
  if (!text) return std::unexpected(text.error());
  auto json = json::parse<Ordered>(*text);
  if (!json.is_object()) return fail(Errc::bad_data, "a report that is no object");
  name_datasets(json, order);
  // A dataset of several files once, in the order in which the program has them.
  for (const char* role : {"input", "less", "against"})
    if (const auto named = json.find(role); named != json.end() && named->is_array())
      *named = datasets_of(*named, order);
  if (const auto input = json.find("input"); input == json.end() || !input->is_array()) {
    Ordered all = Ordered::array();
    for (const auto& [path, name] : order.names) all.push_back(name);
    json["input"] = datasets_of(all, order);
  }
  return json;
}

/// Not every JSON: a profile's may be as large as results get, and is a file as any other.
bool is_report(const JobOrder::Output& output) { return output.name == "report"; }

/// In place of results.
http::Reply none(const Job& job, std::string_view target) {
  if (!job.has_ended())
    return http::problem_reply({.status = 404,
                                .detail = "The job has not ended; its status says how far it is.",
                                .instance = target,
                                .type = kNotReady});
  if (job.status == JobStatus::dismissed)
    return http::problem_reply(
        {.status = 404, .detail = "The job was dismissed.", .instance = target});
  constexpr int kUsage = 2, kData = 65;  // as the command line ends
  if (job.exit_code == Job::kNoRoom || job.exit_code == Job::kUnread)
    return http::problem_reply({.status = 503,
                                .detail = "The job failed: " + message_of(job) + ".",
                                .instance = target,
                                .headers = {{"Retry-After", "60"}}});
  const int status = job.exit_code == kUsage ? 400 : job.exit_code == kData ? 422 : 500;
  return http::problem_reply(
      {.status = status, .detail = "The job failed: " + message_of(job) + ".", .instance = target});
}

http::Reply one(const services::Jobs& jobs, const Job& job, const JobOrder& order,
                const JobOrder::Output& output, const http::Conditions& client,
                std::string_view target) {
  if (!is_report(output)) return file_reply(jobs, job, output, client, target);
  const auto report = report_of(jobs, job, order, output);
  if (!report) return lost(target);
  return http::make_reply(200, output.media_type, json::to_text(*report, 2) + "\n",
                          {{"Cache-Control", "private, no-cache"}});
}

}  // namespace

void read_results(Members& body, JobOrder& order, Problems& problems) {
  std::vector<JobOrder::Output> wanted;
  if (const Json* const outputs = body.member("outputs")) {
    if (!outputs->is_object()) {
      problems.add("outputs", "must be an object, {\"mesh\": {}}");
    } else {
      for (const auto& [name, how] : outputs->items()) {
        const auto found = std::ranges::find(order.outputs, name, &JobOrder::Output::name);
        if (found == order.outputs.end())
          problems.add("outputs." + name.substr(0, 64), "there is no such output");
        else if (!how.is_object())
          problems.add("outputs." + name, "must be an object");
        else
          wanted.push_back(*found);
      }
    }
  }
  if (wanted.empty() && !order.outputs.empty()) wanted.push_back(order.outputs.front());
  order.document = wanted.size() > 1;
  if (const Json* const response = body.member("response")) {
    if (*response == "document")
      order.document = true;
    else if (*response != "raw")
      problems.add("response", "must be raw or document");
    else if (wanted.size() > 1)
      problems.add("response", "raw is of one output; take document for several");
  }
  order.outputs = std::move(wanted);
}

http::Reply results_reply(const services::Jobs& jobs, const Job& job,
                          const http::Conditions& client, std::string_view target,
                          const std::string& origin) {
  if (job.status != JobStatus::successful) return none(job, target);
  if (auto refused = refuse_damaged(jobs, job, target)) return std::move(*refused);
  const JobOrder order = order_of(job);
  if (order.outputs.empty()) return lost(target);
  if (!order.document) return one(jobs, job, order, order.outputs.front(), client, target);
  Ordered document = Ordered::object();
  for (const JobOrder::Output& output : order.outputs) {
    if (!is_report(output)) {
      document[output.name] = {{"href", origin + "/jobs/" + job.id + "/results/" + output.name},
                               {"type", output.media_type}};
      continue;
    }
    auto report = report_of(jobs, job, order, output);
    if (!report) return lost(target);
    document[output.name] = {{"value", std::move(*report)}};
  }
  return http::make_reply(200, "application/json", json::to_text(document, 2) + "\n",
                          {{"Cache-Control", "private, no-cache"}});
}

http::Reply result_reply(const services::Jobs& jobs, const Job& job, std::string_view name,
                         const http::Conditions& client, std::string_view target) {
  if (job.status != JobStatus::successful) return none(job, target);
  if (auto refused = refuse_damaged(jobs, job, target)) return std::move(*refused);
  const JobOrder order = order_of(job);
  const auto output = std::ranges::find(order.outputs, name, &JobOrder::Output::name);
  if (output == order.outputs.end())
    return http::problem_reply(
        {.status = 404, .detail = "The job has no such output.", .instance = target});
  return one(jobs, job, order, *output, client, target);
}

}  // namespace tind::api
