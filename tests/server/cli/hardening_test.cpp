// What the linker made of the program, read from its ELF headers.

#include <elf.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

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
  std::printf("stack protector %s, _FORTIFY_SOURCE %s, CET: %zu places to land\n",
              stack ? "yes" : "no", fortified ? "yes" : "no", places);
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

}  // namespace
}  // namespace tind
