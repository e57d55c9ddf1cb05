#pragma once
// Which extensions of quantized-mesh a client asks for, in any of the ways that clients have.

#include <string_view>

#include "proto/tile/quantized_mesh.h"
#include "server/http/message/request_parser.h"

namespace tind::api {

/// The union of every `extensions=a-b-c` in the Accept field, on whatever media range it stands
/// (some clients put it behind the wrong one), and in the query. Unknown names are ignored. A
/// client that never says the word gets none: serving fewer is always safe.
proto::Extensions asked_extensions(const http::Fields&, std::string_view query);

}  // namespace tind::api
