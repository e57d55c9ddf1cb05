#include "server/services/jobs/job_order.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "terrain/raster/file_state.h"

namespace tind::services {
namespace {

using Json = nlohmann::json;

/// Throws where it is not as text_of() writes it.
void read_order(const Json& json, JobOrder& order) {
  order.arguments = json.at("arguments").get<std::vector<std::string>>();
  order.files = json.at("files").get<std::map<std::string, std::string>>();
  if (const auto encoded = json.find("encoded"); encoded != json.end())  // of an older daemon: none
    order.encoded_files = encoded->get<std::map<std::string, std::string>>();
  order.names = json.at("names").get<std::vector<std::pair<std::string, std::string>>>();
  for (const Json& o : json.at("outputs"))
    order.outputs.push_back({o.at("name"), o.at("file"), o.at("type")});
  order.document = json.at("document").get<bool>();
  order.waited_for = json.value("waited_for", false);  // of an older daemon: not said
  order.sources = json.value("sources", std::map<std::string, std::string>());
}

}  // namespace

std::string state_of_source(const std::string& path) {
  const auto state = file_state(path);  // a device may have another number after a restart
  return state ? fmt::format("{} {} {}", state->inode, state->size, state->written_ns) : "";
}

Result<std::string> text_of(const JobOrder& order) {
  Json outputs = Json::array();
  for (const JobOrder::Output& o : order.outputs)
    outputs.push_back({{"name", o.name}, {"file", o.file}, {"type", o.media_type}});
  const Json json = {{"arguments", order.arguments},   {"files", order.files},
                     {"encoded", order.encoded_files}, {"names", order.names},
                     {"outputs", std::move(outputs)},  {"document", order.document},
                     {"sources", order.sources},       {"waited_for", order.waited_for}};
  try {
    return json.dump();
  } catch (const Json::exception&) {
    return fail(Errc::unsupported,
                "the name of the DEM's file is no UTF-8, which jobs cannot keep");
  }
}

JobOrder order_of(const Job& job) {
  JobOrder order;
  order.process = job.process, order.client = job.client;
  try {
    read_order(Json::parse(job.order ? *job.order : ""), order);
  } catch (const Json::exception&) {  // somebody else has written into the list
    order.arguments.clear(), order.outputs.clear();
  }
  return order;
}

std::string order_when_ended(const Job& job) {
  JobOrder order = order_of(job);
  order.arguments.clear(), order.files.clear(), order.encoded_files.clear();
  order.sources.clear();
  return text_of(order).value_or(job.order ? *job.order : "");
}

}  // namespace tind::services
