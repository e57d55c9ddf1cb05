#pragma once
// Reads and writes of a descriptor that do not end half done: the system may take or give less than
// asked for at any time, and says that it was interrupted or why there is no more only then.

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tind {

/// 0, or errno.
int write_whole(int file, std::string_view bytes);
int write_whole_at(int file, std::uint64_t at, std::string_view bytes);

struct ReadBytes {
  std::size_t size = 0;  // less than asked for: there the file ends, or it cannot be read
  int error = 0;         // errno
};
ReadBytes read_up_to(int file, std::uint64_t at, void* to, std::size_t size);
/// From where the file stands to its end, and forgets it: errno, or 0. For who hands a file on to a
/// reader that takes bytes which cannot be read for none, or asks for them for ever.
int read_to_end(int file);
/// All of them?
bool read_whole_at(int file, std::uint64_t at, void* to, std::size_t size);

}  // namespace tind
