#pragma once
// Processes and jobs at their addresses: JSON for programs, a plain page for people.

#include <nlohmann/json_fwd.hpp>

#include "server/api/ogc/document.h"
#include "server/http/message/reply.h"
#include "server/http/operation.h"

namespace tind::api {

/// The operation with `f` as the last of its words: its first answer can be a page, too.
http::Operation with_page(http::Operation);

// 200, never cached: the document, or its page. The page of a list has each entry as a card that
// leads to it; that of a process its inputs as a table; that of a job that has not ended is loaded
// anew every two seconds. `asked`: of the request.
http::Reply process_list_reply(const ogc::Asked&, nlohmann::ordered_json list);
http::Reply process_reply(const ogc::Asked&, nlohmann::ordered_json process);
http::Reply job_list_reply(const ogc::Asked&, nlohmann::ordered_json list);
http::Reply job_reply(const ogc::Asked&, nlohmann::ordered_json job, bool has_ended);

}  // namespace tind::api
