#pragma once
// The daemon's log: lines on stderr, written by a thread of its own. Whoever logs only puts a line
// into a bounded queue, so that a reader of stderr who is slow, stuck or gone costs lines, which
// are counted, and never an I/O thread its time.
//
//   * control bytes are escaped: a line stays a line, whatever names are in it
//   * of equal warnings and errors the first few in ten seconds are written, the rest counted. What
//     follows " request=" does not make two of them different.
//   * as text, or, for programs that collect logs, as JSON: one object a line, in ASCII

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace tind::logging {

class LogSink;

enum class Form {
  text,  // 2026-11-25T09:30:00.123+00:00 warning the message
  json,  // {"time": "2026-11-25T09:30:00.123+00:00", "level": "warning", "message": "...", ...}
};

/// While it lives, spdlog's functions log to `fd`.
class Log {
 public:
  explicit Log(const std::string& level, Form form = Form::text, int fd = 2);
  /// Writes what waits, as far as `fd` takes it within a moment.
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

 private:
  std::shared_ptr<LogSink> sink_;
};

/// A request that was answered, or bytes that were none. Text must be harmless for a terminal.
struct Access {
  std::string_view method, target;
  std::string_view refused;  // why these bytes were no request: then there is no method or target
  int status = 0;
  std::size_t bytes = 0;  // of the body
  double milliseconds = 0;
  std::string_view client;        // its address, or the name of its key
  std::string_view request = {};  // of an answer that is a problem: its requestId
};
/// Logs it as information: as a line of text, or as an object with these fields.
void log_access(const Access&);

struct LogCounts {
  std::uint64_t dropped = 0;   // stderr did not take them in time
  std::uint64_t repeated = 0;  // not written because they said what others had said
};
/// Since the process began.
LogCounts log_counts();

}  // namespace tind::logging
