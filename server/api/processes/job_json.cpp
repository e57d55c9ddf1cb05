#include "server/api/processes/job_json.h"

#include <fmt/format.h>

#include <ctime>
#include <nlohmann/json.hpp>

namespace tind::api {

using Ordered = nlohmann::ordered_json;

std::string time_text(std::int64_t ms) {
  const std::time_t seconds = ms / 1000;
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", utc.tm_year + 1900,
                     utc.tm_mon + 1, utc.tm_mday, utc.tm_hour, utc.tm_min, utc.tm_sec, ms % 1000);
}

Ordered link_json(const std::string& href, const char* rel, const std::string& type,
                  const std::string& title) {
  Ordered link = {{"href", href}, {"rel", rel}, {"type", type}};
  if (!title.empty()) link["title"] = title;
  return link;
}

Ordered status_json(const services::Job& job) {
  Ordered json = {{"jobID", job.id},
                  {"processID", job.process},
                  {"type", "process"},
                  {"status", name_of(job.status)},
                  {"message", job.message},
                  {"progress", job.progress},
                  {"created", time_text(job.created_ms)}};
  if (job.started_ms > 0) json["started"] = time_text(job.started_ms);
  if (job.finished_ms > 0) json["finished"] = time_text(job.finished_ms);
  json["updated"] = time_text(job.updated_ms);
  const std::string self = "/jobs/" + job.id;
  json["links"] = Ordered::array({link_json(self, "self", "application/json")});
  if (job.status == services::JobStatus::successful) {
    json["links"].push_back(link_json(
        self + "/results", "http://www.opengis.net/def/rel/ogc/1.0/results", "application/json"));
    for (const services::JobOrder::Output& o : order_of(job).outputs)
      json["links"].push_back(link_json(self + "/results/" + o.name, "item", o.media_type, o.name));
  }
  return json;
}

}  // namespace tind::api
