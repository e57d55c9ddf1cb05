#pragma once
// A process that decodes, seen from the daemon: begun, asked one thing at a time, and ended when it
// dies, lies or takes too long.

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/raster/sandbox/spawn.h"
#include "terrain/raster/sandbox/wire.h"

namespace tind::sandbox {

/// What one question may take; more ends the process.
struct Patience {
  std::chrono::milliseconds cpu, wall;
};

/// Of an error of these processes: whether one crashed at what it decodes, and was not ended from
/// outside, as by the system when memory runs out. All ends are Errc::io; their words tell.
bool says_crash(const Error&);

/// How many have died, lied or taken too long since this process began. Thread-safe.
std::uint64_t decoders_failed();

class Decoder {
 public:
  /// Begins a process with those descriptors: spawn(), or a nursery.
  using Begin = std::function<Result<pid_t>(const Descriptors&)>;
  /// One that has `brief` to read. Waits until it says that it is ready. It ends with the calling
  /// thread, if not before. Fails (io) saying why.
  static Result<std::unique_ptr<Decoder>> start(const Begin&, std::string_view brief, Patience);
  /// Ends the process, however it is.
  ~Decoder();
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  /// Its answer, whose number and lengths are sound. An error (io) says what became of the process,
  /// which is of no use afterwards.
  Result<Reply> ask(Request, Patience);
  /// What it answered cannot be: an error that says so. It is not asked again.
  Error lied() { return broken("answered nonsense"); }
  /// Whether nothing is known against it.
  bool good() const { return good_; }
  /// The same, and while nobody asks it anything, it is still there.
  bool alive() const;

  /// Memory that the process may write to at any time: copy first, then judge the copy.
  std::byte* shared() const { return static_cast<std::byte*>(memory_); }
  /// The text of a reply, copied.
  std::string text(const Reply&) const;

  pid_t process() const { return process_; }
  /// How long it has been busy in all.
  std::chrono::milliseconds busy() const { return busy_; }
  /// Files that it has opened for us; for whoever uses it.
  std::set<std::uint32_t> opened;

 private:
  Decoder() = default;
  Result<Reply> hear(std::uint32_t number, Patience);
  void turn_bad();
  Error ended();
  Error broken(const char* how);
  std::chrono::milliseconds cpu() const;

  pid_t process_ = -1;
  int socket_ = -1;
  void* memory_ = nullptr;
  std::uint32_t number_ = 0;
  bool good_ = true;
  std::chrono::milliseconds busy_{0};
};

}  // namespace tind::sandbox
