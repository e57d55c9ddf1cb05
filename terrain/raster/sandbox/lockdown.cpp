// Two fences, since each has holes that the other covers. Seccomp knows system calls and their
// numbers, but no names of files; Landlock knows files, but nothing of processes and sockets.
//
// A refused call is answered with EPERM rather than death: libraries try things that they can do
// without, and an attack that fails is an error of its raster.
//
// The kernel's interface is written out here, because headers may be older than the kernel that
// runs.

#include "terrain/raster/sandbox/lockdown.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>

#include "terrain/base/errno_text.h"
#include "terrain/base/resource_limit.h"

namespace tind::sandbox {
namespace {

// --- Landlock ------------------------------------------------------------------------------------

constexpr long kCreateRuleset = 444, kAddRule = 445, kRestrictSelf = 446;
constexpr std::uint64_t kReadFile = 1u << 2, kReadDir = 1u << 3;

struct Ruleset {
  std::uint64_t files, network, scopes;
};
struct [[gnu::packed]] PathRule {
  std::uint64_t allowed;
  std::int32_t folder;
};

int landlock_version() {
  const long version = ::syscall(kCreateRuleset, nullptr, 0, 1u);
  return version > 0 ? int(version) : 0;
}

/// Everything that a version can forbid, and how much of the struct it knows.
Ruleset all_of(int version, std::size_t& bytes) {
  const int rights = version >= 5 ? 16 : version >= 3 ? 15 : version == 2 ? 14 : 13;
  bytes = version >= 6 ? 24 : version >= 4 ? 16 : 8;
  return {(std::uint64_t(1) << rights) - 1, 3, 3};  // no TCP; no signals, no abstract sockets
}

std::unexpected<Error> failed(const char* what) {
  return fail(Errc::io, std::string("the sandbox: ") + what + ": " + errno_text(errno));
}

Result<void> allow(int ruleset, const std::string& path, std::uint64_t rights) {
  const int place = ::open(path.c_str(), O_PATH | O_CLOEXEC);
  if (place < 0) return {};  // it cannot be opened later either
  const PathRule rule{rights, place};
  const long done = ::syscall(kAddRule, ruleset, 1, &rule, 0);
  const int why = errno;
  ::close(place);
  errno = why;
  if (done != 0) return failed(path.c_str());
  return {};
}

Result<void> fence_files(const Allowed& allowed, int version) {
  std::size_t bytes = 0;
  const Ruleset all = all_of(version, bytes);
  const int ruleset = int(::syscall(kCreateRuleset, &all, bytes, 0));
  if (ruleset < 0) return failed("landlock_create_ruleset");
  Result<void> done;
  for (const std::string& file : allowed.files)
    if (done) done = allow(ruleset, file, kReadFile);
  for (const std::string& folder : allowed.folders)
    if (done) done = allow(ruleset, folder, kReadFile | kReadDir);
  if (done && ::syscall(kRestrictSelf, ruleset, 0) != 0) done = failed("landlock_restrict_self");
  ::close(ruleset);
  return done;
}

// --- seccomp -------------------------------------------------------------------------------------

#if defined(__x86_64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t kArchitecture = AUDIT_ARCH_AARCH64;
#else
constexpr std::uint32_t kArchitecture = 0;  // no table of calls for it
#endif

/// Calls that reading files, memory and C's library need, whatever their arguments. Stat and its
/// kin say that a file is there, not what is in it.
constexpr long kHarmless[] = {
    SYS_read,
    SYS_readv,
    SYS_pread64,
    SYS_preadv,
    SYS_write,
    SYS_writev,
    SYS_close,
    SYS_lseek,
    SYS_fstat,
    SYS_newfstatat,
    SYS_statx,
    SYS_statfs,
    SYS_fstatfs,
    SYS_faccessat,
    SYS_readlinkat,
    SYS_getcwd,
    SYS_getdents64,
    SYS_fadvise64,
    SYS_munmap,
    SYS_mremap,
    SYS_madvise,
    SYS_brk,
    SYS_futex,
    SYS_sched_yield,
    SYS_sched_getaffinity,
    SYS_getrandom,
    SYS_clock_gettime,
    SYS_clock_getres,
    SYS_clock_nanosleep,
    SYS_nanosleep,
    SYS_gettimeofday,
    SYS_times,
    SYS_getrusage,
    SYS_sysinfo,
    SYS_uname,
    SYS_getpid,
    SYS_gettid,
    SYS_getppid,
    SYS_getuid,
    SYS_geteuid,
    SYS_getgid,
    SYS_getegid,
    SYS_rt_sigaction,
    SYS_rt_sigprocmask,
    SYS_rt_sigreturn,
    SYS_sigaltstack,
    SYS_restart_syscall,
    SYS_exit,
    SYS_exit_group,
    SYS_ppoll,
#ifdef SYS_faccessat2
    SYS_faccessat2,
#endif
#ifdef SYS_poll  // the old names, which newer architectures lack
    SYS_poll,
    SYS_stat,
    SYS_lstat,
    SYS_access,
    SYS_readlink,
    SYS_time,
#endif
};

constexpr std::uint32_t low_word(int argument) {
  return std::uint32_t(offsetof(seccomp_data, args)) + 8 * std::uint32_t(argument);
}

/// A program for the kernel's filter: each rule either answers, or leaves the number of the call
/// loaded for the next one. What no rule answers is refused.
class Filter {
 public:
  Filter() {
    load(offsetof(seccomp_data, arch));
    jump(BPF_JEQ, kArchitecture, 1, 0);
    answer(SECCOMP_RET_KILL_PROCESS);  // numbers mean something else there
    load(offsetof(seccomp_data, nr));
  }
  void allow(long call) {
    jump(BPF_JEQ, std::uint32_t(call), 0, 1);
    answer(SECCOMP_RET_ALLOW);
  }
  /// Where none of these bits is set in an argument.
  void allow_without(long call, int argument, std::uint32_t bits) {
    jump(BPF_JEQ, std::uint32_t(call), 0, 4);
    load(low_word(argument));
    jump(BPF_JSET, bits, 0, 1);
    answer(SECCOMP_RET_ERRNO | EPERM);
    answer(SECCOMP_RET_ALLOW);
  }
  /// Where an argument is this number.
  void allow_with(long call, int argument, std::uint32_t number) {
    jump(BPF_JEQ, std::uint32_t(call), 0, 6);
    load(low_word(argument));
    jump(BPF_JEQ, number, 0, 3);
    load(low_word(argument) + 4);
    jump(BPF_JEQ, 0, 0, 1);
    answer(SECCOMP_RET_ALLOW);
    answer(SECCOMP_RET_ERRNO | EPERM);
  }
  /// Where an argument of 32 bits is one of these numbers.
  void allow_with_any(long call, int argument, std::initializer_list<std::uint32_t> numbers) {
    jump(BPF_JEQ, std::uint32_t(call), 0, std::uint8_t(2 * numbers.size() + 2));
    load(low_word(argument));
    for (const std::uint32_t number : numbers) {
      jump(BPF_JEQ, number, 0, 1);
      answer(SECCOMP_RET_ALLOW);
    }
    answer(SECCOMP_RET_ERRNO | EPERM);
  }
  bool set() {
    answer(SECCOMP_RET_ERRNO | EPERM);
    const sock_fprog program{static_cast<unsigned short>(code_.size()), code_.data()};
    return ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
  }

 private:
  void load(std::size_t at) { code_.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, __u32(at))); }
  void jump(int how, std::uint32_t number, std::uint8_t yes, std::uint8_t no) {
    code_.push_back(BPF_JUMP(__u16(BPF_JMP | BPF_K | how), number, yes, no));
  }
  void answer(std::uint32_t what) { code_.push_back(BPF_STMT(BPF_RET | BPF_K, what)); }
  std::vector<sock_filter> code_;
};

constexpr std::uint32_t kWriting = O_WRONLY | O_RDWR | O_CREAT | O_TRUNC;

bool fence_calls() {
  Filter filter;
  for (const long call : kHarmless) filter.allow(call);
  filter.allow_without(SYS_openat, 2, kWriting);
#ifdef SYS_open
  filter.allow_without(SYS_open, 1, kWriting);
#endif
  filter.allow_without(SYS_mmap, 2, PROT_EXEC);
  filter.allow_without(SYS_mprotect, 2, PROT_EXEC);
  // Not F_SETOWN and F_SETSIG: with them the kernel signals whom the caller likes.
  filter.allow_with_any(
      SYS_fcntl, 1,
      {F_DUPFD, F_GETFD, F_SETFD, F_GETFL, F_GETLK, F_SETLK, F_SETLKW, F_DUPFD_CLOEXEC});
  filter.allow_with(SYS_tgkill, 0, std::uint32_t(::getpid()));  // abort()
  filter.allow_with(SYS_prlimit64, 2, 0);                       // asking for limits
  return filter.set();
}

bool has_seccomp() {
  if (kArchitecture == 0) return false;
  std::uint32_t action = SECCOMP_RET_ERRNO;
  return ::syscall(SYS_seccomp, SECCOMP_GET_ACTION_AVAIL, 0, &action) == 0;
}

}  // namespace

Support supported() { return {has_seccomp(), landlock_version()}; }

std::string missing_text(const Support& has) {
  std::string text;
  if (has.landlock == 0) text = "Landlock (a raster that takes over its decoder can read any file)";
  if (!has.seccomp)
    text += std::string(text.empty() ? "" : " and ") +
            "seccomp filters (it can begin programs and connections)";
  return text;
}

Result<Support> lock_down(const Allowed& allowed, const Lockdown& limits) {
  Support has = supported();
  bool good = set_limit(RLIMIT_CORE, 0) && set_limit(RLIMIT_FSIZE, 0) &&
              set_limit(RLIMIT_NPROC, 0) && set_limit(RLIMIT_NOFILE, limits.open_files);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // whose shadows take terabytes
  if (limits.memory_bytes > 0) good = good && set_limit(RLIMIT_AS, limits.memory_bytes);
#endif
  if (limits.cpu_seconds > 0) good = good && set_limit(RLIMIT_CPU, limits.cpu_seconds);
  if (!good)
    return failed(
        "no limits can be set (let whoever begins it allow prlimit64, or leave the sandbox out)");
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) return failed("no_new_privs");
  if (has.landlock > 0)
    if (auto done = fence_files(allowed, has.landlock); !done) return std::unexpected(done.error());
  if (has.seccomp && !fence_calls()) return failed("seccomp");
  return has;
}

}  // namespace tind::sandbox
