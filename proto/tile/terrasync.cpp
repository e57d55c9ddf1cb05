#include "proto/tile/terrasync.h"

#include <algorithm>

namespace tind::proto {

std::string encode_dirindex(std::string_view path, std::vector<DirEntry> entries) {
  std::ranges::sort(entries, {}, &DirEntry::name);
  std::string text = "version:1\npath:";
  text.append(path) += '\n';
  for (const DirEntry& e : entries) {
    text += e.kind == DirEntry::folder ? "d:" : "f:";
    text += e.name + ':' + e.sha1;
    if (e.kind == DirEntry::file) text += ':' + std::to_string(e.bytes);
    text += '\n';
  }
  return text;
}

std::string encode_stg(std::string_view file, std::span<const std::string> remarks) {
  std::string text;
  for (const std::string& remark : remarks) text += "# " + remark + '\n';
  text.append("OBJECT_BASE ").append(file) += '\n';
  return text;
}

}  // namespace tind::proto
