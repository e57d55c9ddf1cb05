#pragma once
// Requests that a web page makes in somebody's browser, and what their Host tells of where the page
// is from: a page of elsewhere can have its own name lead to this machine (DNS rebinding), and is
// of the same origin then.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/message/reply.h"
#include "server/http/message/request.h"

namespace tind::api {

/// Browsers say where a page that asks comes from; programs do not.
bool is_of_page(const http::Request&);

/// An address, or localhost: no name that somebody else could make lead here.
bool names_this_machine(std::string_view host);

/// Names under which jobs may be asked for, and other pages that may.
struct JobPages {
  std::vector<std::string> hosts, origins;
};

/// The answer (403) to who asks for jobs under a name that is none of the hosts and not of this
/// machine, or from a page of another such name that is none of the origins: jobs are of who asked
/// for them, and all pages in browsers here have one address. Of where a page is from browsers do
/// not tell with a GET of the same origin, so the name counts for everybody.
std::optional<http::Reply> refuse_jobs_of_strangers(const http::Request&, const JobPages&);

}  // namespace tind::api
