#include "terrain/base/whole_io.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string>
#include <thread>

#include "terrain/base/descriptor.h"

namespace tind {
namespace {

std::string pattern(std::size_t size) {
  std::string text(size, '\0');
  for (std::size_t i = 0; i < size; ++i) text[i] = char('a' + i % 23);
  return text;
}

TEST(WholeIo, WritesAllIntoAPipeThatTakesLittleAtATime) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  const Descriptor from(ends[0]);
  Descriptor to(ends[1]);
  const std::string sent = pattern(1 << 20);  // a pipe holds 64 KiB
  std::string got;
  std::jthread reader([&] {
    std::array<char, 1000> some{};
    for (ssize_t n; (n = ::read(from.get(), some.data(), some.size())) > 0;)
      got.append(some.data(), std::size_t(n));
  });
  EXPECT_EQ(write_whole(to.get(), sent), 0);
  to.close();
  reader.join();
  EXPECT_EQ(got, sent);
}

TEST(WholeIo, SaysWhyItCannotWrite) {
  EXPECT_EQ(write_whole(-1, "x"), EBADF);
  EXPECT_EQ(write_whole_at(-1, 0, "x"), EBADF);
  EXPECT_EQ(write_whole(-1, ""), 0);
  const Descriptor full(::open("/dev/full", O_WRONLY | O_CLOEXEC));
  EXPECT_EQ(write_whole(full.get(), "x"), ENOSPC);
}

TEST(WholeIo, SaysWhereItCannotReadToTheEnd) {
  const Descriptor whole(::open("/proc/self/exe", O_RDONLY | O_CLOEXEC));
  EXPECT_EQ(read_to_end(whole.get()), 0);
  EXPECT_EQ(::lseek(whole.get(), 0, SEEK_CUR), ::lseek(whole.get(), 0, SEEK_END));
  const Descriptor memory(::open("/proc/self/mem", O_RDONLY | O_CLOEXEC));  // nothing is at 0
  EXPECT_EQ(read_to_end(memory.get()), EIO);
}

TEST(WholeIo, ReadsUpToTheEnd) {
  const Descriptor file(::memfd_create("whole", MFD_CLOEXEC));
  const std::string bytes = pattern(1000);
  ASSERT_EQ(write_whole_at(file.get(), 5, bytes), 0);
  std::string got(1000, '?');
  EXPECT_TRUE(read_whole_at(file.get(), 5, got.data(), got.size()));
  EXPECT_EQ(got, bytes);
  EXPECT_FALSE(read_whole_at(file.get(), 6, got.data(), got.size()));
  const ReadBytes rest = read_up_to(file.get(), 905, got.data(), got.size());
  EXPECT_EQ(rest.size, 100u);
  EXPECT_EQ(rest.error, 0);
  EXPECT_EQ(got.substr(0, 100), bytes.substr(900));
  EXPECT_EQ(read_up_to(-1, 0, got.data(), 1).error, EBADF);
}

}  // namespace
}  // namespace tind
