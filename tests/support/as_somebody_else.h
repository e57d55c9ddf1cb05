#pragma once
// What cannot be read or looked at, as root, too: root may look into everything.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace tind::test {

inline constexpr uid_t kSomebody = 65534;

/// As a user who is not the files' own.
class AsSomebodyElse {
 public:
  AsSomebodyElse() : user_(::geteuid()) {
    if (user_ == 0 && ::seteuid(kSomebody) != 0) ADD_FAILURE();
  }
  ~AsSomebodyElse() {
    if (user_ == 0 && ::seteuid(user_) != 0) std::abort();
  }
  AsSomebodyElse(const AsSomebodyElse&) = delete;
  AsSomebodyElse& operator=(const AsSomebodyElse&) = delete;

 private:
  const uid_t user_;
};

/// Makes the folder and what is below it that user's own.
inline void give_to_somebody(const std::string& folder) {
  if (::geteuid() != 0) return;  // who runs this may not read what has no rights, either
  std::filesystem::permissions(std::filesystem::path(folder).parent_path(),
                               std::filesystem::perms(0755));
  EXPECT_EQ(::lchown(folder.c_str(), kSomebody, gid_t(-1)), 0);
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    EXPECT_EQ(::lchown(entry.path().c_str(), kSomebody, gid_t(-1)), 0);
}

/// Takes all rights from a file or a folder as long as it lives.
class Closed {
 public:
  explicit Closed(std::string path)
      : path_(std::move(path)), before_(std::filesystem::status(path_).permissions()) {
    std::filesystem::permissions(path_, std::filesystem::perms::none);
  }
  ~Closed() { std::filesystem::permissions(path_, before_); }
  Closed(const Closed&) = delete;
  Closed& operator=(const Closed&) = delete;

 private:
  const std::string path_;
  const std::filesystem::perms before_;
};

}  // namespace tind::test
