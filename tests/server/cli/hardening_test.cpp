// What compiler and linker made of the program, read from its ELF file, and what it makes of what
// its process inherits.

#include <elf.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/file_io.h"
#include "tests/support/program.h"

namespace tind {
namespace {

struct Elf {
  std::string bytes;
  Elf64_Ehdr head{};

  explicit Elf(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
    if (bytes.size() >= sizeof head) std::memcpy(&head, bytes.data(), sizeof head);
  }

  template <class T>
  std::vector<T> table(std::uint64_t at, std::uint64_t count) const {
    if (at + count * sizeof(T) > bytes.size()) return {};
    std::vector<T> entries(count);
    std::memcpy(entries.data(), bytes.data() + at, count * sizeof(T));
    return entries;
  }
  std::vector<Elf64_Phdr> segments() const { return table<Elf64_Phdr>(head.e_phoff, head.e_phnum); }
  std::vector<Elf64_Dyn> dynamic() const {
    for (const Elf64_Phdr& segment : segments())
      if (segment.p_type == PT_DYNAMIC)
        return table<Elf64_Dyn>(segment.p_offset, segment.p_filesz / sizeof(Elf64_Dyn));
    return {};
  }
};

bool bound_at_start(const Elf& elf) {
  for (const Elf64_Dyn& entry : elf.dynamic())
    if ((entry.d_tag == DT_FLAGS && entry.d_un.d_val & DF_BIND_NOW) ||
        (entry.d_tag == DT_FLAGS_1 && entry.d_un.d_val & DF_1_NOW))
      return true;
  return false;
}

/// Whether it imports a function of that name: what the compiler calls where it has put a check.
bool imports(const Elf& elf, const char* name) {
  const std::string entry = std::string(1, '\0') + name + '\0';  // of the table of names
  return elf.bytes.find(entry) != std::string::npos;
}

/// Whether it says of itself that all of it keeps to CET. The linker says so only where each file
/// that it was given does, those of the system, too; and only then could anybody enforce it.
bool all_is_marked(const Elf& elf) {
  for (const Elf64_Phdr& segment : elf.segments()) {
    if (segment.p_type != PT_GNU_PROPERTY) continue;
    const auto words = elf.table<Elf64_Word>(segment.p_offset, segment.p_filesz / 4);
    const auto found = std::ranges::find(words, GNU_PROPERTY_X86_FEATURE_1_AND);
    if (words.end() - found > 2) return found[2] & GNU_PROPERTY_X86_FEATURE_1_IBT;
  }
  return false;
}

/// Places where an indirect jump may land: endbr64, which the compiler puts there for CET.
std::size_t landing_places(const Elf& elf) {
  constexpr std::string_view kEndbr64 = "\xf3\x0f\x1e\xfa";
  std::size_t count = 0;
  for (std::size_t at = 0; (at = elf.bytes.find(kEndbr64, at)) != std::string::npos; ++at) ++count;
  return count;
}

TEST(Hardening, TheCompilerHasPutChecksIntoTheProgram) {
  const Elf elf(test::tind_binary());
  const bool stack = imports(elf, "__stack_chk_fail");
  const bool fortified = imports(elf, "__memcpy_chk") || imports(elf, "__read_chk") ||
                         imports(elf, "__snprintf_chk") || imports(elf, "__memset_chk");
  const std::size_t places = landing_places(elf);
  std::printf("stack protector %s, _FORTIFY_SOURCE %s\n", stack ? "yes" : "no",
              fortified ? "yes" : "no");
  std::printf("branch targets are marked (endbr64) at %zu places%s\n", places,
              all_is_marked(elf) ? ", in all of the program"
                                 : "; not enforced, as the system's own files are not marked");
#if defined(NDEBUG) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_TRUE(stack && fortified);
#if defined(__x86_64__) && defined(__CET__)
  EXPECT_GT(places, 1000u);
#endif
#endif
}

TEST(Hardening, TheProgramIsMovableAndItsTablesAreReadOnly) {
  const Elf elf(test::tind_binary());
  ASSERT_EQ(std::memcmp(elf.bytes.data(), ELFMAG, SELFMAG), 0);
  ASSERT_EQ(elf.head.e_ident[EI_CLASS], ELFCLASS64);
  bool relro = false, stack_executable = true;
  for (const Elf64_Phdr& segment : elf.segments()) {
    relro |= segment.p_type == PT_GNU_RELRO;
    if (segment.p_type == PT_GNU_STACK) stack_executable = segment.p_flags & PF_X;
    EXPECT_FALSE(segment.p_type == PT_LOAD && segment.p_flags & PF_W && segment.p_flags & PF_X);
  }
  const bool pie = elf.head.e_type == ET_DYN, now = bound_at_start(elf);
  std::printf("PIE %s, RELRO %s, bound at start %s, executable stack %s\n", pie ? "yes" : "no",
              relro ? "yes" : "no", now ? "yes" : "no", stack_executable ? "yes" : "no");
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // those have a fixed address
  EXPECT_TRUE(pie);
#endif
  EXPECT_TRUE(relro && now);
  EXPECT_FALSE(stack_executable);
}

/// A line of /proc/PID/`file` of a daemon, which is begun by what stands `before` it.
std::string said_of_daemon(const std::string& before, const std::string& option,
                           const std::string& file, const std::string& line) {
  const test::TempDir folder;
  const std::string said = folder.file("said"), found = folder.file("found");
  const std::string script = before + " '" + test::tind_binary() + "' serve --as-root " + option +
                             " '" + test::testdata("desert.asc") +
                             "' --listen 127.0.0.1:0 --jobs 0 --index-dir '" +
                             folder.file("indexes") + "' >'" + said +
                             "' 2>&1 & p=$!; for i in $(seq 600); do grep -q serving '" + said +
                             "' && break; kill -0 $p || break; sleep .05; done; grep '^" + line +
                             "' /proc/$p/" + file + " >'" + found + "'; kill $p; wait $p";
  EXPECT_EQ(std::system(script.c_str()), 0) << read_whole_file(said).value_or("");
  return read_whole_file(found).value_or("");
}

TEST(Hardening, ItLeavesNoCoreFileWhereThatIsSaid) {
  rlimit may{};
  ASSERT_EQ(::getrlimit(RLIMIT_CORE, &may), 0);
  if (may.rlim_max == 0) GTEST_SKIP() << "nobody may leave one here";
  const std::string limit = said_of_daemon("", "--no-core-dumps", "limits", "Max core file size");
  unsigned long now = 1, most = 1;
  ASSERT_EQ(std::sscanf(limit.c_str(), "Max core file size %lu %lu", &now, &most), 2) << limit;
  EXPECT_EQ(now, 0u);
  EXPECT_EQ(most, 0u);
}

/// Who starts it may have said that nobody asks how children end.
TEST(Hardening, ItAsksHowItsChildrenEnd) {
  const std::string ignored = said_of_daemon("env --ignore-signal=CHLD", "", "status", "SigIgn:");
  unsigned long signals = ~0ul;
  ASSERT_EQ(std::sscanf(ignored.c_str(), "SigIgn: %lx", &signals), 1) << ignored;
  EXPECT_FALSE(signals >> (SIGCHLD - 1) & 1) << ignored;
}

}  // namespace
}  // namespace tind
