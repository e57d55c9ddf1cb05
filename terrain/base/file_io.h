#pragma once
// Whole files in and out; what does not work is an error with the operating system's reason:
// not_found where there is none to be read, else io.

#include <memory>
#include <string>
#include <string_view>

#include "terrain/base/result.h"

namespace tind {

/// The bytes of a file, or "cannot open PATH: reason".
Result<std::string> read_whole_file(const std::string& path);
/// The same of a regular file (or a link to one) only: a pipe or a device would keep who reads it.
Result<std::string> read_regular_file(const std::string& path);

/// Writes PATH by way of a temporary file in the same folder and a rename: whoever looks sees the
/// old file or the new one, never a part; a failed write leaves nothing behind. When it returns,
/// the file stays also if the power is cut. A symbolic link is followed; something that is not a
/// regular file (a pipe) is written directly, and so is what is open already (/dev/stdout).
Result<void> write_whole_file(const std::string& path, std::string_view bytes);

/// The same of bytes that come one after the other and are too many to be held.
class FileWriter {
 public:
  static Result<FileWriter> create(const std::string& path);
  FileWriter(FileWriter&&) noexcept;
  FileWriter& operator=(FileWriter&&) = delete;
  ~FileWriter();

  Result<void> write(std::string_view bytes);
  /// From now on the file is there; without it, the one that was. Once, and the last call.
  Result<void> finish();

 private:
  struct Partial;
  explicit FileWriter(std::unique_ptr<Partial>);
  std::unique_ptr<Partial> partial_;
};

/// Its first bytes, `most` at most. A pipe keeps nobody waiting.
Result<std::string> read_beginning(const std::string& path, std::size_t most);

/// Of a file that has this name because write_whole_file() was killed before its rename: the name
/// that it was to get. Else empty. Both are without their folder.
std::string finished_name(const std::string& name);
/// Removes such files of PATH; other things of such names stay. REQUIRES: nobody writes it now.
Result<void> remove_partials_of(const std::string& path);

/// Could PATH be written, as far as one can tell beforehand? To be asked before long work; leaves
/// nothing behind. Or write_whole_file's message.
Result<void> can_write_file(const std::string& path);

}  // namespace tind
