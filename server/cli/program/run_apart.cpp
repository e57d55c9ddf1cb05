// The child writes what it found into a pipe, field by field; the parent reads all of it, then asks
// how the child ended. Both are one program on one machine, so numbers go as they are.

#include "server/cli/program/run_apart.h"

#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <type_traits>

#include "server/cli/program/peak_memory.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/whole_io.h"

namespace tind::cli {

namespace {

class Sink {
 public:
  explicit Sink(int file) : file_(file) {}
  void bytes(void* data, std::size_t n) {
    if (write_whole(file_, {static_cast<const char*>(data), n}) != 0)
      std::_Exit(1);  // nobody reads: the parent is gone
  }

 private:
  int file_;
};

class Source {
 public:
  explicit Source(int file) : file_(file) {}
  void bytes(void* data, std::size_t n) {
    char* at = static_cast<char*>(data);
    while (n > 0 && !ended_) {
      const ssize_t got = ::read(file_, at, n);
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) ended_ = true;
      if (got > 0) at += got, n -= std::size_t(got);
    }
    if (ended_) std::memset(at, 0, n);
  }
  bool ended() const { return ended_; }

 private:
  int file_;
  bool ended_ = false;
};

// One walk over the fields serves both directions.

template <class Way, class T>
requires std::is_trivially_copyable_v<T>
void pass(Way& way, T& value) { way.bytes(&value, sizeof value); }

template <class Way, class List>
requires std::is_trivially_copyable_v<typename List::value_type>
void pass(Way& way, List& list) {
  std::uint64_t n = list.size();
  pass(way, n);
  list.resize(n);
  way.bytes(list.data(), n * sizeof(typename List::value_type));
}

template <class Way>
void pass(Way& way, std::map<std::string, double>& map) {
  std::uint64_t n = map.size();
  pass(way, n);
  auto at = map.begin();
  for (std::uint64_t i = 0; i < n; ++i) {
    std::string key = at == map.end() ? "" : at->first;
    double value = at == map.end() ? 0 : at->second;
    pass(way, key);
    pass(way, value);
    if (at != map.end())
      ++at;
    else
      map.emplace(std::move(key), value);
  }
}

template <class Way>
void pass(Way& way, MeasuredRun& run) {
  pass(way, run.seconds);
  pass(way, run.cpu_seconds);
  pass(way, run.peak_mb);
  pass(way, run.page_faults);
  bool made = run.made.has_value();
  pass(way, made);
  if (!made) {
    Error error = run.made ? Error{} : run.made.error();
    pass(way, error.code);
    pass(way, error.what);
    run.made = std::unexpected(std::move(error));
    return;
  }
  if (!run.made) run.made = Simplified{};
  Simplified& s = *run.made;
  pass(way, s.tin.vertices);
  pass(way, s.tin.triangles);
  pass(way, s.tin.colours);
  pass(way, s.tin.normals);
  pass(way, s.tin.texcoords);
  pass(way, s.steps);
  pass(way, s.input_triangles);
  pass(way, s.note);
  pass(way, s.details);
}

double seconds_of(const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); }

MeasuredRun measure_here(const std::function<Result<Simplified>()>& make) {
  rusage before{}, after{};
  PeakMemory::forget();
  ::getrusage(RUSAGE_SELF, &before);
  const auto start = std::chrono::steady_clock::now();
  MeasuredRun run{make()};
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  ::getrusage(RUSAGE_SELF, &after);
  run.cpu_seconds = seconds_of(after.ru_utime) - seconds_of(before.ru_utime) +
                    seconds_of(after.ru_stime) - seconds_of(before.ru_stime);
  run.page_faults = std::uint64_t(after.ru_minflt - before.ru_minflt);
  run.peak_mb = PeakMemory::megabytes();
  return run;
}

MeasuredRun failed(const std::string& why) {
  return {fail(Errc::internal, "the run in a process of its own " + why)};
}

}  // namespace

MeasuredRun run_apart(const std::function<Result<Simplified>()>& make) {
  int ends[2];
  if (::pipe(ends) != 0) return failed(std::string("has no pipe: ") + errno_text(errno));
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child < 0) {
    const int code = errno;
    ::close(ends[0]), ::close(ends[1]);
    return failed(std::string("did not start: ") + errno_text(code));
  }
  if (child == 0) {
    // It works for whoever began it, and for nobody once that is killed.
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (::getppid() != parent) std::_Exit(1);
    ::close(ends[0]);
    MeasuredRun run = measure_here(make);
    Sink sink(ends[1]);
    pass(sink, run);
    std::_Exit(0);  // nothing of the parent's is flushed or torn down twice
  }
  ::close(ends[1]);
  Source source(ends[0]);
  MeasuredRun run{Simplified{}};
  pass(source, run);
  ::close(ends[0]);
  int status = 0;  // where the system does not tell: source.ended() does
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status))
    return failed("was ended by signal " + std::to_string(WTERMSIG(status)) +
                  (WTERMSIG(status) == SIGKILL ? " (out of memory?)" : ""));
  if (source.ended()) return failed("gave no result");
  return run;
}

}  // namespace tind::cli
