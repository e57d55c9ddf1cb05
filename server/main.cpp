// tind: the table of subcommands.

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>

#include "server/cli/commands/commands.h"
#include "server/cli/program/data_dir.h"
#include "server/cli/program/gdal_environment.h"
#include "server/cli/program/standard_output.h"
#include "server/log/printable.h"
#include "terrain/base/errno_text.h"
#include "terrain/geo/environment.h"
#include "terrain/raster/sandboxed_pool.h"

#ifndef TIND_VERSION
#define TIND_VERSION "0"
#endif

namespace {

/// The exit code, unless what was printed did not arrive: a full disk shows at the end, and whoever
/// reads the file must not take its beginning for the answer.
int once_printed(int exit, const std::string& reason = {}) {
  const bool failed = std::fflush(stdout) != 0;
  if (!failed && !std::ferror(stdout)) return exit;
  // Others have said on stderr why; what is wrong with data is in the report that is lost.
  if (exit != tind::cli::kOk && exit != tind::cli::kBadData) return exit;
  const std::string why = failed ? tind::errno_text(errno) : reason;
  std::fprintf(stderr, "tind: cannot write to standard output%s%s\n", why.empty() ? "" : ": ",
               why.c_str());
  return exit == tind::cli::kOk ? tind::cli::kIo : exit;
}

[[noreturn]] void end_without_memory() {
  constexpr std::string_view kText =
      "tind: out of memory: run it again with more, with fewer --threads, or (build) a smaller "
      "--memory\n";
  [[maybe_unused]] const auto told = write(STDERR_FILENO, kText.data(), kText.size());
  std::_Exit(tind::cli::kTryAgain);
}

std::terminate_handler usual_end = nullptr;

/// Memory may end in a thread, or in a function that promises not to throw: no reason to abort.
void end_honestly() {
  try {
    if (const auto thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::bad_alloc&) {
    end_without_memory();
  } catch (...) {  // NOLINT(bugprone-empty-catch): the usual end says what it was
  }
  usual_end();
}

/// Before the objects with static storage are made, which allocate, too.
__attribute__((constructor(101))) void begin_honestly() {
  usual_end = std::set_terminate(end_honestly);
}

/// Of what fits in, the reason why it does not arrive is known at the end, when it is written.
void keep_back_output() {
  static char output[1 << 16];  // until the end: glibc takes no size without it
  if (isatty(STDOUT_FILENO) == 0) std::setvbuf(stdout, output, _IOFBF, sizeof output);
}

/// Who starts us may have closed them, and a file that we open would be the one that messages go
/// to. For reading: what is printed fails, as it does on a closed one.
void hold_standard_descriptors() {
  for (const int each : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(each, F_GETFD) < 0) [[maybe_unused]]
      const int lowest = ::open("/dev/null", O_RDONLY);
}

/// Who starts us may have said that nobody asks how children end, or may hear signals in threads of
/// its own: both are inherited. We do ask, and mean to hear when we are to stop.
void take_signals_back() {
  std::signal(SIGCHLD, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  ::pthread_sigmask(SIG_SETMASK, &none, nullptr);  // of the only thread yet
}

int run(int argc, char** argv) {
  hold_standard_descriptors();
  take_signals_back();
  tind::cli::forget_gdal_options();
  // Not a command of anybody's: what `serve` begins to decode rasters in. It starts often.
  if (argc == 2 && std::strcmp(argv[1], tind::kDecoderArgument) == 0)
    return tind::decode_for_others();
  if (argc == 2 && std::strcmp(argv[1], tind::kNurseryArgument) == 0)
    return tind::nurse_for_others();
  tind::cli::Program program(
      "tind: terrain meshes whose error is known. DEMs in, simplified TINs and tiles out.",
      "tind " TIND_VERSION, std::make_shared<const tind::Environment>(tind::cli::data_dir()));
  keep_back_output();
  // A limit on the size of files is an error of the one that is written, not the end of the
  // program.
  std::signal(SIGXFSZ, SIG_IGN);
  tind::cli::Command app = program.root();
  int exit = tind::cli::kOk;
  // subcommands: one line each
  tind::cli::add_simplify(app, exit);
  tind::cli::add_refine(app, exit);
  tind::cli::add_progressive(app, exit);
  tind::cli::add_extract(app, exit);
  tind::cli::add_between(app, exit);
  tind::cli::add_measure(app, exit);
  tind::cli::add_compare(app, exit);
  tind::cli::add_contours(app, exit);
  tind::cli::add_derivatives(app, exit);
  tind::cli::add_elevation(app, exit);
  tind::cli::add_profile(app, exit);
  tind::cli::add_line_of_sight(app, exit);
  tind::cli::add_viewshed(app, exit);
  tind::cli::add_relief(app, exit);
  tind::cli::add_volume(app, exit);
  tind::cli::add_statistics(app, exit);
  tind::cli::add_difference(app, exit);
  tind::cli::add_methods(app, exit);
  tind::cli::add_formats(app, exit);
  tind::cli::add_info(app, exit);
  tind::cli::add_build(app, exit);
  tind::cli::add_plan_build(app, exit);
  tind::cli::add_merge(app, exit);
  tind::cli::add_status(app, exit);
  tind::cli::add_check(app, exit);
  tind::cli::add_verify(app, exit);
  tind::cli::add_copy(app, exit);
  tind::cli::add_estimate(app, exit);
  tind::cli::add_export(app, exit);
  tind::cli::add_explain(app, exit);
  tind::cli::add_plan(app, exit);
  tind::cli::add_serve(app, exit);
  tind::cli::add_key(app, exit);
  // Last: commands take over the footer that there is.
  app.footer(
      "tind COMMAND --help says what a command takes.\n"
      "Exit codes: 0 done; 1 a bug; 2 wrong arguments; 65 bad data; 69 no such input;\n"
      "73 an output cannot be created; 74 reading or writing failed on the way;\n"
      "75 stopped by a signal while writing many files (run it again to go on), or out of memory");
  if (const std::string wrong = tind::cli::unknown_command(app, argc, argv); !wrong.empty()) {
    std::fprintf(stderr, "tind: %s\n", wrong.c_str());
    return tind::cli::kUsage;
  }
  try {
    const auto words = tind::cli::give_standard_output(argc, argv);
    const auto parsed = program.parse(argc, words.data());
    std::istringstream lines(parsed.errors);
    for (std::string line; std::getline(lines, line);)
      std::fprintf(stderr, "%s\n", tind::logging::printable(line).c_str());
    if (!parsed.ran) return once_printed(parsed.good ? tind::cli::kOk : tind::cli::kUsage);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& e) {
    const auto* const of_system = dynamic_cast<const std::system_error*>(&e);
    if (std::ferror(stdout))  // fmt throws when it cannot print
      return once_printed(tind::cli::kOk, of_system ? of_system->code().message() : "");
    if (of_system && of_system->code() == std::errc::resource_unavailable_try_again) {
      std::fputs(
          "tind: the system has no more threads or memory to give; end other programs, or "
          "raise the limits, and run it again\n",
          stderr);
      return tind::cli::kTryAgain;
    }
    // Of Asio, whose errors are no std::system_error.
    if (std::strstr(e.what(), tind::errno_text(EMFILE).c_str())) {
      std::fprintf(stderr, "tind: %s: raise the limit (ulimit -n), and run it again\n", e.what());
      return tind::cli::kIo;
    }
    std::fprintf(stderr, "tind: internal error: %s\n", e.what());
    return tind::cli::kInternal;
  }
  return once_printed(exit);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::bad_alloc&) {
    end_without_memory();
  }
}
