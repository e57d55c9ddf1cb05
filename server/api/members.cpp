#include "server/api/members.h"

#include <algorithm>

#include "proto/json_member.h"
#include "proto/json_text.h"
#include "server/api/json_problem.h"
#include "terrain/base/short_text.h"

namespace tind::api {
namespace {

constexpr std::size_t kLongestName = 64;  // of a stranger's member, as we repeat it
const Json kNothing = Json::object();

std::string shown(const std::string& name) {
  const std::string_view begin = short_text(name, std::min(kLongestName, name.find('\0')));
  return begin.empty() ? "\"\"" : std::string(begin);
}

}  // namespace

Json parse_body(std::string_view body, std::size_t most_values, Problems& problems) {
  if (json::count_values(body) > most_values) {
    problems.add("body", "must have at most " + std::to_string(most_values) + " JSON values");
    return kNothing;
  }
  Json json = json::parse<Json>(body);
  if (json.is_object())
    return has_names_once(body, json::values_of(json), problems) ? json : kNothing;
  problems.add("body", json.is_discarded() ? why_no_json(body) : "must be a JSON object");
  return kNothing;
}

bool has_names_once(std::string_view body, std::size_t built, Problems& problems) {
  if (json::count_values(body) == built) return true;
  const auto twice = json::name_said_twice(body);
  if (twice) problems.add(shown(*twice), "is there twice in one object: which of them counts?");
  return !twice;
}

Members::Members(const Json& json, std::string path, Problems& problems)
    : object_(json.is_object() ? json : kNothing), path_(std::move(path)), problems_(problems) {
  if (!json.is_object()) problems_.add(path_, "must be an object");
}

std::string Members::name_of(const char* member) const {
  return path_.empty() ? member : path_ + "." + member;
}

const Json* Members::member(const char* name, Need need) {
  known_.push_back(name);
  if (const Json* const found = json::member(object_, name)) return found;
  if (need == Need::must) problems_.add(name_of(name), "missing");
  return nullptr;
}

void Members::number(const char* name, double low, double high, double& value, Need need) {
  const Json* const found = member(name, need);
  if (!found) return;
  if (const auto x = json::as_number(*found, low, high))
    value = *x;
  else
    problems_.add(name_of(name),
                  "must be a number from " + Json(low).dump() + " to " + Json(high).dump());
}

void Members::nothing_else() {
  for (const auto& [name, value] : object_.items()) {
    if (std::ranges::find(known_, name) != known_.end()) continue;
    problems_.add(name_of(shown(name).c_str()), "is not known here");
  }
}

}  // namespace tind::api
