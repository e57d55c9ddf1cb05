#pragma once
// The texts that lead FlightGear to its scenery: .stg, which says what a bucket is made of, and
// .dirindex, by which TerraSync follows folders on a server.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tind::proto {

/// A file or a folder of an index.
struct DirEntry {
  enum Kind { file, folder } kind = file;
  std::string name;
  std::string sha1;         // of the file; of a folder, of its .dirindex
  std::uint64_t bytes = 0;  // of a file
};

/// `path`: of the folder, from the root; empty for the root itself. Sorted by name, so that an
/// index is a function of what is in the folder.
std::string encode_dirindex(std::string_view path, std::vector<DirEntry>);

/// A bucket whose ground is `file` beside it. `remarks`: lines that FlightGear does not read.
std::string encode_stg(std::string_view file, std::span<const std::string> remarks);

}  // namespace tind::proto
