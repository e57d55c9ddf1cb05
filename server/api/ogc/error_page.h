#pragma once
// Errors at the addresses of OGC API, for people: whoever opens one of them in a browser gets the
// problem as a plain page.

#include "server/http/router.h"

namespace tind::api::ogc {

/// Of a GET of /collections, /processes, ... and all below them whose client would rather have a
/// page (`f`, or Accept): what makes one of the problem, with its status and its fields. Of all
/// other requests nothing.
http::Router::ErrorForm error_form(const http::Request&);

}  // namespace tind::api::ogc
