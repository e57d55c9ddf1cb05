#pragma once
// Every limit of the HTTP side in one place: limits are data.

#include <chrono>
#include <cstddef>

namespace tind::http {

struct Limits {
  std::size_t head_bytes = 8192;  // request line and fields together; less than 65536
  std::size_t fields = 100;       // many small fields are as costly as few large ones
  std::size_t connections = 4096;

  std::chrono::milliseconds head_timeout{10'000};   // from a request's first byte to its empty line
  std::chrono::milliseconds idle_timeout{75'000};   // between requests of a kept connection
  std::chrono::milliseconds body_timeout{30'000};   // of a POST, all of it
  std::chrono::milliseconds write_timeout{30'000};  // without the client taking a single byte
  std::chrono::milliseconds linger_timeout{2'000};  // reading on after a refusal, so it arrives

  std::chrono::milliseconds accept_backoff{100};  // after running out of file descriptors
};

}  // namespace tind::http
