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

/// The answer (403) to a page that asks for jobs under a name that is none of `hosts` and not of
/// this machine: jobs are of who asked for them, and everybody in a browser here has one address.
std::optional<http::Reply> refuse_jobs_of_strangers(const http::Request&,
                                                    const std::vector<std::string>& hosts);

}  // namespace tind::api
