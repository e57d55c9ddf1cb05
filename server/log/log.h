#pragma once
// The daemon's log: lines on stderr, written by a thread of its own. Whoever logs only puts a line
// into a bounded queue, so that a reader of stderr who is slow, stuck or gone costs lines, which
// are counted, and never an I/O thread its time.
//
//   * control bytes are escaped: a line stays a line, whatever names are in it
//   * of equal warnings and errors the first few in ten seconds are written, the rest counted. What
//     follows " request=" does not make two of them different.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace tind::logging {

class LogSink;

/// While it lives, spdlog's functions log to `fd`.
class Log {
 public:
  explicit Log(const std::string& level, int fd = 2);
  /// Writes what waits, as far as `fd` takes it within a moment.
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

 private:
  std::shared_ptr<LogSink> sink_;
};

struct LogCounts {
  std::uint64_t dropped = 0;   // stderr did not take them in time
  std::uint64_t repeated = 0;  // not written because they said what others had said
};
/// Since the process began.
LogCounts log_counts();

}  // namespace tind::logging
