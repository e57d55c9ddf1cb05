#include "server/api/processes/list_page.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "server/api/processes/job_json.h"

namespace tind::api {
namespace {

constexpr double kFarthest = 1e6;  // more than any list has

/// The address of this page with another offset.
std::string with_offset(const std::string& url, std::size_t offset) {
  return with_parameter(url, "offset", offset > 0 ? std::to_string(offset) : "");
}

}  // namespace

std::string with_parameter(const std::string& url, const std::string& name,
                           const std::string& value) {
  const std::size_t mark = url.find('?');
  std::string query;
  for (std::size_t at = mark == url.npos ? url.size() : mark + 1; at < url.size();) {
    const std::size_t end = std::min(url.find('&', at), url.size());
    const std::string one = url.substr(at, end - at);
    if (!one.starts_with(name + "=")) query += (query.empty() ? "" : "&") + one;
    at = end + 1;
  }
  if (!value.empty()) query += (query.empty() ? "" : "&") + name + "=" + value;
  return url.substr(0, mark) + (query.empty() ? "" : "?" + query);
}

std::vector<http::QueryNumber> page_numbers() {
  return {{.name = "limit",
           .least = 1,
           .most = double(kLongestPage),
           .unit = "entries",
           .whole = true,
           .about = "at most so many; 1000 without it",
           .example = "100"},
          {.name = "offset",
           .least = 0,
           .most = kFarthest,
           .unit = "entries",
           .whole = true,
           .about = "leaves out so many, as the link `next` does"}};
}

ListPage list_page(const http::QueryNumbers& query) {
  return {std::size_t(query.values[1].value_or(0)),
          std::size_t(query.values[0].value_or(double(kLongestPage)))};
}

nlohmann::ordered_json page_links(const ogc::Asked& asked, const ListPage& page,
                                  std::size_t entries) {
  const char* const type = asked.form == ogc::Form::html ? ogc::kHtml : ogc::kJson;
  const auto at = [&](std::size_t offset, const char* rel) {
    return link_json(with_offset(asked.own_url(), offset), rel, type);
  };
  auto links = nlohmann::ordered_json::array({link_json(asked.own_url(), "self", type)});
  if (page.offset + page.limit < entries) links.push_back(at(page.offset + page.limit, "next"));
  if (page.offset > 0) links.push_back(at(page.offset - std::min(page.offset, page.limit), "prev"));
  return links;
}

}  // namespace tind::api
