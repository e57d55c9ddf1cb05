// What a process can no longer do. Each is tried twice, in a process of its own: before, where it
// works, and after.

#include "terrain/raster/sandbox/lockdown.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/in_process.h"
#include "tests/support/support.h"

namespace tind::sandbox {
namespace {

bool opens(const std::string& path, int how) {
  const int fd = ::open(path.c_str(), how, 0600);
  if (fd >= 0) ::close(fd);
  return fd >= 0;
}

bool has_socket(int family) {
  const int fd = ::socket(family, SOCK_STREAM, 0);
  if (fd >= 0) ::close(fd);
  return fd >= 0;
}

/// Whether a program begins, in a process that is made for it where that is possible.
bool executes() {
  const long child = ::syscall(SYS_clone, SIGCHLD, nullptr, nullptr, nullptr, nullptr);
  if (child < 0) return ::execl("/bin/true", "true", nullptr) == 0;  // it does not come back
  if (child == 0) {
    ::execl("/bin/true", "true", nullptr);
    ::_exit(1);
  }
  int status = 1;
  ::waitpid(pid_t(child), &status, 0);
  return status == 0;
}

bool begins_a_process() {
  const long child = ::syscall(SYS_clone, SIGCHLD, nullptr, nullptr, nullptr, nullptr);
  if (child == 0) ::_exit(0);
  if (child > 0) ::waitpid(pid_t(child), nullptr, 0);
  return child > 0;
}

bool begins_a_thread() {
  pthread_t thread;
  if (::pthread_create(
          &thread, nullptr, [](void*) -> void* { return nullptr; }, nullptr) != 0)
    return false;
  return ::pthread_join(thread, nullptr) == 0;
}

/// One that lets anybody look into it, and ends with this.
class Bystander {
 public:
  Bystander() {
    int ready[2];
    if (::pipe(ready) != 0) return;
    process_ = ::fork();
    if (process_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      ::prctl(PR_SET_PTRACER, PR_SET_PTRACER_ANY);
      ::close(ready[0]);
      ::close(ready[1]);
      for (;;) ::pause();
    }
    ::close(ready[1]);
    char none;
    [[maybe_unused]] const ssize_t end = ::read(ready[0], &none, 1);
    ::close(ready[0]);
  }
  ~Bystander() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
  }
  Bystander(const Bystander&) = delete;
  Bystander& operator=(const Bystander&) = delete;
  pid_t process() const { return process_; }

 private:
  pid_t process_ = -1;
};

pid_t bystander = -1;

bool traces_another() { return ::ptrace(PTRACE_SEIZE, bystander, nullptr, nullptr) == 0; }

/// It is a copy of whoever began both: what is there in one is there in the other.
bool reads_another() {
  pid_t copy = 0;
  const iovec to{&copy, sizeof copy}, from{&bystander, sizeof bystander};
  return ::process_vm_readv(bystander, &to, 1, &from, 1, 0) == ssize_t(sizeof copy);
}

bool has_memory_to_run() {
  void* const code =
      ::mmap(nullptr, 4096, PROT_READ | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (code == MAP_FAILED) return false;
  ::munmap(code, 4096);
  return true;
}

bool makes_memory_run() {
  void* const data =
      ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  return ::mprotect(data, 4096, PROT_READ | PROT_EXEC) == 0;
}

struct Attempt {
  const char* what;
  bool (*works)();
  bool needs_landlock;
};

std::string allowed_file, other_file, new_file;

constexpr Attempt kAttempts[] = {
    {"open a TCP socket", [] { return has_socket(AF_INET); }, false},
    {"open a Unix socket", [] { return has_socket(AF_UNIX); }, false},
    {"begin a process", begins_a_process, false},
    {"begin a thread", begins_a_thread, false},
    {"execute a program", executes, false},
    {"read another process's memory", reads_another, false},
    {"trace another process", traces_another, false},
    {"signal the process that began it", [] { return ::kill(::getppid(), 0) == 0; }, false},
    {"have the kernel signal another process",
     [] { return ::fcntl(0, F_SETOWN, ::getppid()) == 0 && ::fcntl(0, F_SETOWN, 0) == 0; }, false},
    {"choose that signal",
     [] { return ::fcntl(0, F_SETSIG, SIGKILL) == 0 && ::fcntl(0, F_SETSIG, 0) == 0; }, false},
    {"have signals sent", [] { return ::fcntl(0, F_SETFL, ::fcntl(0, F_GETFL)) == 0; }, false},
    {"make executable memory", has_memory_to_run, false},
    {"make memory executable", makes_memory_run, false},
    {"open its file for writing", [] { return opens(allowed_file, O_RDWR); }, false},
    {"make a file", [] { return opens(new_file, O_CREAT | O_WRONLY); }, false},
    {"remove a file", [] { return ::unlink(new_file.c_str()) == 0; }, false},
    {"make a pipe",
     [] {
       int ends[2];
       return ::pipe(ends) == 0;
     },
     false},
    {"change its folder", [] { return ::chdir("/") == 0; }, false},
    {"read another file", [] { return opens(other_file, O_RDONLY); }, true},
    {"read /etc/passwd", [] { return opens("/etc/passwd", O_RDONLY); }, true},
    {"read its own maps", [] { return opens("/proc/self/maps", O_RDONLY); }, true},
    {"list a folder", [] { return opens("/etc", O_RDONLY | O_DIRECTORY); }, true},
};

/// One letter each: y, n.
std::string try_all() {
  std::string tried;
  for (const Attempt& attempt : kAttempts) tried += attempt.works() ? 'y' : 'n';
  return tried;
}

TEST(Lockdown, WhatReadingDoesNotNeedIsRefused) {
  const Support has = supported();
  if (!has.seccomp) GTEST_SKIP() << "this system has no seccomp filters";
  const test::TempDir folder;
  allowed_file = folder.file("allowed.tif"), other_file = folder.file("other.tif");
  new_file = folder.file("new");
  std::ofstream(allowed_file) << "heights";
  std::ofstream(other_file) << "secrets";
  const Bystander other;
  bystander = other.process();
  const std::string before = test::in_process(try_all);
  std::ofstream(new_file) << "to be removed";
  const std::string after = test::in_process([]() -> std::string {
    const auto locked =
        lock_down({{allowed_file, "/no/such/file"}, {}}, {.memory_bytes = 4ul << 30});
    if (!locked) return locked.error().what;
    if (!opens(allowed_file, O_RDONLY)) return "its own file cannot be read";
    return try_all();
  });
  ASSERT_EQ(before.size(), std::size(kAttempts)) << before;
  ASSERT_EQ(after.size(), std::size(kAttempts)) << after;
  std::size_t shown = 0;
  for (std::size_t i = 0; i < std::size(kAttempts); ++i) {
    if (kAttempts[i].needs_landlock && has.landlock == 0) continue;
    EXPECT_EQ(after[i], 'n') << kAttempts[i].what;
    if (before[i] == 'y') ++shown;  // a container may refuse one or the other by itself
  }
  EXPECT_GE(shown, 8u) << before;
  if (has.landlock == 0) GTEST_SKIP() << "this system has no Landlock: files were not tried";
}

TEST(Lockdown, MemoryAndFoldersAreBounded) {
  if (test::kSanitized) GTEST_SKIP() << "sanitizers take terabytes of addresses";
  const std::string said = test::in_process([]() -> std::string {
    const auto locked = lock_down({{}, {"/usr"}}, {.memory_bytes = 1ul << 30});
    if (!locked) return locked.error().what;
    if (!opens("/usr", O_RDONLY | O_DIRECTORY)) return "its folder cannot be listed";
    void* const much =
        ::mmap(nullptr, 2ul << 30, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return much == MAP_FAILED ? "bounded" : "not bounded";
  });
  EXPECT_EQ(said, "bounded");
}

/// Whoever began the process may have left it no way to set limits. What would then be without them
/// is not begun.
TEST(Lockdown, WithoutItsLimitsItFails) {
  if (!supported().seccomp) GTEST_SKIP() << "this system has no seccomp filters";
  const std::string said = test::in_process([]() -> std::string {
    if (!test::forbid_limits()) return "no filter";
    const auto locked = lock_down({}, {.cpu_seconds = 60});
    return locked ? "locked down without limits" : "failed";
  });
  EXPECT_EQ(said, "failed");
}

TEST(Lockdown, SaysWhatIsMissing) {
  EXPECT_EQ(missing_text({true, 1}), "");
  EXPECT_NE(missing_text({true, 0}).find("Landlock"), std::string::npos);
  EXPECT_NE(missing_text({false, 1}).find("seccomp"), std::string::npos);
}

}  // namespace
}  // namespace tind::sandbox
