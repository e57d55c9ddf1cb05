#pragma once
// Files of a build on a disk whose power can be cut.

#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "terrain/base/result.h"
#include "terrain/store/folder/folder_files.h"

namespace tind::test {

/// Files that are not synced: the machine of the tests keeps its power, and its disk has other
/// things to do.
class Unsynced : public FolderFiles {
 public:
  Result<void> sync_file(const std::string&) override { return {}; }
  Result<void> sync_folder(const std::string&) override { return {}; }
  Result<void> sync_all(const std::string&) override { return {}; }
};

/// Does each step on the real disk, and keeps a list of them. From that list it makes folders as a
/// power cut after any step could have left them: what was synced is there; of the rest, names may
/// be the old or the new ones, each by itself, and files empty, short, full of zeros or torn
/// between sectors.
class WatchedFiles : public FolderFiles {
 public:
  /// `root` is watched, with what lies in it now, all of it synced.
  explicit WatchedFiles(const std::string& root);

  Result<void> make_folder(const std::string& path) override;
  Result<void> write(const std::string& path, std::string_view bytes) override;
  Result<void> write_at(const std::string& path, std::uint64_t at, std::string_view) override;
  Result<void> rename(const std::string& from, const std::string& to) override;
  Result<void> remove(const std::string& path) override;
  Result<void> sync_file(const std::string& path) override;
  Result<void> sync_folder(const std::string& path) override;
  Result<void> sync_all(const std::string& folder) override;

  std::size_t steps() const { return steps_.size(); }
  /// What a cut after the first `steps` could leave, written below the folder `to`.
  void leave(std::size_t steps, std::mt19937& random, const std::string& to) const;

 private:
  struct Step {
    enum class Kind { folder, write, write_at, rename, remove, sync_file, sync_folder, sync_all };
    Kind kind = Kind::folder;
    std::string path, other;  // relative to the root
    std::uint64_t at = 0;
  };
  class Disk;

  std::string relative(const std::string& path) const;
  template <class F>
  Result<void> done(Step step, F&& really);

  std::string root_;
  std::vector<std::string> begin_folders_;
  std::map<std::string, std::string> begin_files_;
  std::mutex mutex_;
  std::vector<Step> steps_;
};

}  // namespace tind::test
