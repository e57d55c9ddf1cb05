#pragma once
// SRTM tiles out of numbers: files whose bytes are nothing but heights, for tests that change them.

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <string>

namespace tind::test {

inline constexpr int kSrtmSide = 1201;

/// A 3" tile: `height` of column and row.
inline std::string srtm(const std::function<int(int, int)>& height) {
  std::string bytes;
  bytes.reserve(std::size_t(kSrtmSide) * kSrtmSide * 2);
  for (int r = 0; r < kSrtmSide; ++r)
    for (int c = 0; c < kSrtmSide; ++c) {
      const int z = height(c, r);
      bytes += char(z >> 8), bytes += char(z);
    }
  return bytes;
}
inline std::string srtm(int height) {
  return srtm([=](int, int) { return height; });
}

inline void write_bytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// In place and by and by, so that the file is never shorter than before. False on failure.
inline bool overwrite_bytes(const std::string& path, const std::string& bytes) {
  constexpr std::size_t kPiece = 65536;
  const int file = ::open(path.c_str(), O_WRONLY);
  bool good = file >= 0;
  for (std::size_t at = 0; good && at < bytes.size(); at += kPiece)
    good = ::pwrite(file, bytes.data() + at, std::min(kPiece, bytes.size() - at), off_t(at)) > 0;
  if (file >= 0) ::close(file);
  return good;
}

}  // namespace tind::test
