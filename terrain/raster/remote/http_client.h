#pragma once
// One question and one answer by HTTP, as they were: nothing is followed, retried or guessed here.
// The implementation is the only user of libcurl: GDAL's own access to the network hides which
// status an answer had, and takes some failures for success.

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"

namespace tind::remote {

struct HttpRequest {
  std::string method = "GET";  // GET, HEAD, PUT, DELETE
  std::string url;             // http:// or https://
  std::vector<std::string> headers;
  std::string_view body;                // of a PUT; must outlive the call
  std::size_t most_bytes = 64u << 20u;  // of the answer's body
};

struct HttpReply {
  int status = 0;
  std::map<std::string, std::string> headers;  // names in small letters; of several the last
  std::vector<std::uint8_t> body;

  /// Empty where there is none.
  std::string header(const std::string& name) const;
};

/// The answer has ended, with as many bytes as it announced. Fails (io) where there was none, or
/// not all of it within `patience` and the time that so many bytes may take (100 kB/s), or where it
/// has more than most_bytes (out_of_range). Redirects are answers. Environment: proxies, as libcurl
/// has them, but never on the way to this machine. Thread-safe; keeps connections.
Result<HttpReply> ask(const HttpRequest&, std::chrono::milliseconds patience);

/// Does the URL name this machine: localhost, 127.0.0.0/8 or [::1]?
bool is_loopback(std::string_view url);

}  // namespace tind::remote
