#pragma once
// A folder of files as a table made once at start: a request's path is looked up in it and never
// becomes a path of the file system.

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "server/http/message/representation.h"
#include "terrain/base/result.h"

namespace tind::http {

class StaticFiles {
 public:
  StaticFiles() = default;
  /// Every regular file below `directory`, in memory, compressed where that pays. Names that begin
  /// with a dot are left out; symbolic links are not followed.
  static Result<StaticFiles> load(const std::string& directory);

  /// "a/b.js", exactly as below the directory; a name that is a folder with an index.html, or "",
  /// is that page. Null when there is none.
  std::shared_ptr<const Representation> find(std::string_view name) const;
  std::size_t size() const { return files_.size(); }
  std::size_t memory_bytes() const;

 private:
  std::map<std::string, std::shared_ptr<const Representation>, std::less<>> files_;
};

}  // namespace tind::http
