#pragma once
// What jobs have made, as clients get it.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "server/api/members.h"
#include "server/http/message/negotiate.h"
#include "server/http/message/reply.h"
#include "server/services/jobs/jobs.h"

namespace tind::api {

/// The members `outputs` and `response` of an execute request, into an order whose outputs are all
/// that there are. Without `outputs`: the first.
void read_results(Members&, services::JobOrder&, Problems&);

/// All that was asked for: the only output as it is, or a document. What there is in place of
/// results, while there are none, is a problem. Reads files: on a worker. `origin`: what the
/// addresses in a document begin with.
http::Reply results_reply(const services::Jobs&, const services::Job&, const http::Conditions&,
                          std::string_view target, const std::string& origin);
/// One output, by its name; also those that nobody asked for are there for a while.
http::Reply result_reply(const services::Jobs&, const services::Job&, std::string_view output,
                         const http::Conditions&, std::string_view target);

}  // namespace tind::api
