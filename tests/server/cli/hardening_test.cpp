// What the linker made of the program, read from its ELF headers.

#include <elf.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
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
