#include "server/api/processes/pages.h"

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "proto/json_text.h"
#include "server/api/processes/job_json.h"
#include "server/api/processes/list_page.h"

namespace tind::api {
namespace {

using Ordered = nlohmann::ordered_json;

bool is_page(const ogc::Asked& asked) { return asked.form == ogc::Form::html; }

http::Reply reply_of(const ogc::Asked& asked, Ordered document,
                     std::vector<http::Header> fields = {}) {
  const std::string url = asked.own_url();
  document["links"].push_back(
      is_page(asked)
          ? link_json(with_parameter(url, "f", "json"), "alternate", ogc::kJson, "as JSON")
          : link_json(with_parameter(url, "f", "html"), "alternate", ogc::kHtml, "as a page"));
  fields.push_back({"Cache-Control", "no-store"});
  fields.push_back({"Vary", "Accept"});
  const auto [type, text] = ogc::shown(asked, document);
  return http::make_reply(200, type, text, fields);
}

/// What a value of a schema may be, for a person: "number, 0 or more; 5 without it".
std::string words_of(const Ordered& schema) {
  const auto text = [](const Ordered& value) {
    return value.is_string() ? value.get<std::string>() : json::to_text(value);
  };
  if (const auto forms = schema.find("oneOf"); forms != schema.end()) {
    std::string all;
    for (const Ordered& form : *forms) all += (all.empty() ? "" : " or ") + words_of(form);
    return all;
  }
  std::string out = schema.value("type", "anything");
  if (out == "array" && schema.contains("items"))
    out = "list of " + words_of(schema["items"]);
  else if (const auto words = schema.find("enum"); words != schema.end()) {
    out.clear();
    for (const Ordered& word : *words) out += (out.empty() ? "" : ", ") + text(word);
  }
  if (schema.contains("minimum")) out += ", at least " + text(schema["minimum"]);
  if (schema.contains("exclusiveMinimum")) out += ", more than " + text(schema["exclusiveMinimum"]);
  if (schema.contains("maximum")) out += ", at most " + text(schema["maximum"]);
  if (schema.contains("default")) out += "; " + text(schema["default"]) + " without it";
  return out;
}

/// {"bbox": {title, description, schema}} as rows of one table.
Ordered rows_of(const Ordered& members) {
  Ordered rows = Ordered::array();
  for (const auto& [name, member] : members.items()) {
    std::string what = member.value("title", "");
    if (const std::string more = member.value("description", ""); !more.empty())
      what += (what.empty() ? "" : ": ") + more;
    rows.push_back({{"name", name},
                    {"needed", member.value("minOccurs", 0) > 0 ? "yes" : ""},
                    {"takes", words_of(member.value("schema", Ordered::object()))},
                    {"what", what}});
  }
  return rows;
}

}  // namespace

http::Operation with_page(http::Operation operation) {
  operation.words.push_back(ogc::form_word());
  operation.responses.front().content.push_back({ogc::kHtml, R"({"type": "string"})"});
  return operation;
}

http::Reply process_list_reply(const ogc::Asked& asked, Ordered list) {
  if (is_page(asked)) {
    list["title"] = "Processes";
    list["description"] = "What can be done with the datasets, as jobs: each is asked for by POST.";
  }
  return reply_of(asked, std::move(list));
}

http::Reply process_reply(const ogc::Asked& asked, Ordered process) {
  if (is_page(asked)) {
    process["inputs"] = rows_of(process["inputs"]);
    Ordered outputs = rows_of(process["outputs"]);
    for (Ordered& row : outputs) {  // what a request says, which an output does not
      row.erase("needed");
      row.erase("takes");
    }
    process["outputs"] = std::move(outputs);
  }
  return reply_of(asked, std::move(process));
}

http::Reply job_list_reply(const ogc::Asked& asked, Ordered list) {
  if (is_page(asked)) {
    list["title"] = "Jobs";
    list["description"] = list["jobs"].empty()
                              ? "None of yours: a request with Prefer: respond-async makes one."
                              : "Yours, the newest first.";
    for (Ordered& job : list["jobs"])
      job["title"] = job.value("processID", "") + ": " + job.value("status", "");
    if (list["jobs"].empty()) list.erase("jobs");
  }
  return reply_of(asked, std::move(list));
}

http::Reply job_reply(const ogc::Asked& asked, Ordered job, bool has_ended) {
  std::vector<http::Header> fields;
  if (is_page(asked)) {
    job["title"] = job.value("processID", "") + ": " + job.value("status", "");
    job["progress"] = json::to_text(job["progress"]) + " %";
    if (!has_ended) fields.push_back({"Refresh", "2"});
  }
  return reply_of(asked, std::move(job), std::move(fields));
}

}  // namespace tind::api
