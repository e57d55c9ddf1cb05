#pragma once
// Every limit of the HTTP side in one place: limits are data.

#include <chrono>
#include <cstddef>

namespace tind::http {

struct Limits {
  std::size_t head_bytes = 8192;  // request line and fields together; less than 65536
  std::size_t fields = 100;       // many small fields are as costly as few large ones
  std::size_t connections = 4096;
  std::size_t per_address = 1024;  // of these, from one address (IPv6: one /64)
  std::size_t extra = 16;          // beyond these, for each I/O thread: for a look at its health

  std::chrono::milliseconds head_timeout{10'000};   // from a request's first byte to its empty line
  std::chrono::milliseconds idle_timeout{75'000};   // between requests of a kept connection
  std::chrono::milliseconds body_timeout{30'000};   // of a POST, all of it
  std::chrono::milliseconds stall_age{1'000};       // of half a request, until it may give way
  std::chrono::milliseconds write_timeout{30'000};  // in which a client must take ...
  std::size_t write_rate = 1024;                    // ... so many bytes a second, or all there is
  std::chrono::milliseconds look_after{500};  // how often: has who waits for an answer hung up?
  std::chrono::milliseconds linger_timeout{2'000};  // reading on after a refusal, so it arrives
  std::chrono::milliseconds extra_timeout{1'000};   // head_timeout of who is there beyond the limit
  std::chrono::milliseconds quiet_timeout{1'000};   // idle_timeout once the port is closed
};

}  // namespace tind::http
