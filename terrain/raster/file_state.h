#pragma once
// Detects files that changed since they were opened. Reading a source can take hours; meanwhile
// another program may write to the file at its path, truncate it, replace it or remove it.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrain/base/result.h"

namespace tind {

/// What the system says of a file. Two are the same when device, inode, size and time of the last
/// write are. (Not the time of the last change of its inode, `changed_ns`: a link that is made, or
/// rights that are given, leave the content alone.)
struct FileState {
  std::uint64_t device = 0, inode = 0, size = 0;
  std::int64_t written_ns = 0, changed_ns = 0;

  bool same_content(const FileState& o) const {
    return device == o.device && inode == o.inode && size == o.size && written_ns == o.written_ns;
  }
};

/// Errc::io where there is none; the message names the file.
Result<FileState> file_state(const std::string& path);

/// What ends the messages of FileStates::unchanged(): for whoever knows better what is to be done.
inline constexpr std::string_view kChangedRemedy =
    "; it is in use: put it back as it was, or open it anew (a daemon: reload) to read what is "
    "there now";

/// The files that a source is made of, as they were when it was opened. Thread-safe once made.
class FileStates {
 public:
  /// Records a file. A second write right after a first one may leave the same time. So if the
  /// last write is very recent, add() waits until a next one would have another time (0.02 s; on
  /// file systems that count whole seconds, up to 2 s).
  Result<void> add(const std::string& path);
  /// Records a file that is not there, and would be another source if it were. One that is there is
  /// none of these.
  void expect_none(const std::string& path);

  /// Errc::io, naming the file and what became of it, unless all are as they were. What was read of
  /// them before a call that succeeds is of their content as it was when they were added.
  Result<void> unchanged() const;

  struct Entry {
    std::string path;
    FileState state;
  };
  std::span<const Entry> entries() const { return entries_; }

 private:
  std::vector<Entry> entries_;
  std::vector<std::string> absent_;
};

}  // namespace tind
