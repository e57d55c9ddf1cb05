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
                                                    const JobPages& ours) {
  if (!request.path.starts_with("/jobs") && !request.path.ends_with("/execution"))
    return std::nullopt;
  const auto is_ours = [&](std::string_view host) {
    const std::string name = lower_case(std::string(name_in(host)));
    return names_this_machine(host) || std::ranges::find(ours.hosts, name) != ours.hosts.end();
  };
  const auto origin = request.head.fields.find("origin");
  const auto scheme = origin ? origin->find("://") : std::string_view::npos;
  const bool from_here = !origin ||
                         (scheme != origin->npos && is_ours(origin->substr(scheme + 3))) ||
                         std::ranges::find(ours.origins, *origin) != ours.origins.end();
  if (from_here && is_ours(request.head.host)) return std::nullopt;
  return http::problem_reply(
      {.status = 403,
       .detail =
           "Jobs are not for what comes under a name that the daemon does not know as its own "
           "(the settings hosts and cors-origins).",
       .instance = request.head.target});
}

}  // namespace tind::api
