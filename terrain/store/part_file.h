#pragma once
// A file that gets its name when it is whole: until then it is NAME.tind-part beside it.

#include <cstdint>
#include <string>
#include <string_view>

#include "terrain/base/result.h"

namespace tind {

/// One writer at a time; what a killed one left is written over. A link is followed, so that it
/// stays one.
class PartFile {
 public:
  /// `begins`: of each kind of file that may be written over as left behind; anything else that
  /// lies at NAME.tind-part is in the way (invalid_argument). busy where somebody writes to it.
  static Result<PartFile> begin(const std::string& path, std::string_view begins);

  PartFile(PartFile&& other) noexcept;
  PartFile& operator=(PartFile&&) = delete;
  ~PartFile();  // without finish(): removes it

  const std::string& path() const { return part_; }
  int file() const { return file_; }  // to read and to write
  Result<void> write_at(std::uint64_t at, std::string_view bytes);
  /// Takes the name, at once and for good.
  Result<void> finish();

 private:
  PartFile(int file, std::string target, std::string part)
      : file_(file), target_(std::move(target)), part_(std::move(part)) {}

  int file_;
  std::string target_, part_;
};

/// All of them, or io.
Result<void> write_all_at(int file, std::uint64_t at, std::string_view bytes,
                          const std::string& name);

}  // namespace tind
