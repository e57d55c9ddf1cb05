#include "server/api/web_pages.h"

#include <algorithm>
#include <cctype>

#include "server/http/message/problem.h"
#include "terrain/base/lower_case.h"

namespace tind::api {
namespace {

/// Without the port.
std::string_view name_in(std::string_view host) {
  return host.substr(0, host.starts_with('[') ? host.find(']') + 1 : host.find(':'));
}

}  // namespace

bool is_of_page(const http::Request& request) {
  const auto site = request.head.fields.find("sec-fetch-site");
  return request.head.fields.find("origin") || (site && *site != "none");
}

bool names_this_machine(std::string_view host) {
  const std::string_view name = name_in(host);
  return name.empty() || name == "localhost" || name.starts_with('[') ||
         std::ranges::all_of(name, [](unsigned char c) { return std::isdigit(c) || c == '.'; });
}

std::optional<http::Reply> refuse_jobs_of_strangers(const http::Request& request,
                                                    const std::vector<std::string>& hosts) {
  const bool of_jobs = request.path.starts_with("/jobs") || request.path.ends_with("/execution");
  if (!of_jobs || !is_of_page(request) || names_this_machine(request.head.host))
    return std::nullopt;
  const std::string name = lower_case(std::string(name_in(request.head.host)));
  if (std::ranges::find(hosts, name) != hosts.end()) return std::nullopt;
  return http::problem_reply(
      {.status = 403,
       .detail = "Jobs are not for web pages under a name that the daemon does not know as its own "
                 "(the setting hosts).",
       .instance = request.head.target});
}

}  // namespace tind::api
