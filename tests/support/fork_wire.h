#pragma once
// What a fork client sends a fork server: this, beside the descriptors of its streams and its
// folder; then so many bytes, arguments and environment, each ended by a null. The answer is a
// status of waitpid().

namespace tind::test {

struct ForkAsked {
  int argc = 0;
  int closed = 0;  // which of 0, 1, 2 are not open, a bit each
  unsigned long bytes = 0;
};

constexpr int kForkFds = 4;  // 0, 1, 2, the working folder

}  // namespace tind::test
