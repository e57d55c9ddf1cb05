#pragma once
// A folder that is a catalog: everything in it is a dataset, and what is put there or taken away
// comes and goes while the daemon runs.
//
//   * a raster is a dataset of its name without the extension; so is a folder or an archive of
//     tiles, and a folder of rasters, which are one dataset; NAME.toml holds the keys of a
//     [[dataset]] table
//   * names that begin with a dot, and files that belong to others (x.prj, x.aux.xml), are passed
//     over
//   * what is still being written waits until it has been the same for a while

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/services/datasets/dataset_spec.h"
#include "terrain/base/result.h"

namespace tind {
struct Dataset;
}

namespace tind::services {

/// One thing that lies there.
struct FolderEntry {
  std::string path;
  DatasetSpec spec;     // its name is that of the entry
  std::string state;    // changes when its files do
  std::string content;  // the same without the table itself: a comment more changes no dataset
  bool rests = false;
  std::string wrong;    // why it cannot be a dataset; empty: it may be one
  bool unread = false;  // ... for now: it cannot be looked at
  bool is_table = false;
};

/// Tables, each read once for each state of its file.
class CatalogTables {
 public:
  /// `name`: where the table gives none.
  const Result<DatasetSpec>& read(const std::string& file, const std::string& name);

 private:
  struct Read {
    std::string state;
    Result<DatasetSpec> spec;
  };
  std::map<std::string, Read> read_;  // by file
};

class CatalogFolder {
 public:
  using Clock = std::chrono::steady_clock;
  /// For so long what lies there must have been the same.
  static constexpr std::chrono::milliseconds kRest{2000};

  explicit CatalogFolder(std::string folder) : folder_(std::move(folder)) {}
  const std::string& folder() const { return folder_; }

  /// Everything there, by name. What was last written to kRest ago or longer rests already when it
  /// is seen for the first time; with `tables_rest` tables do as they are, since whoever asks says
  /// that they are finished. Errc::not_found or io where the folder cannot be read; io, too, where
  /// it is empty and another one than that in which something was.
  Result<std::vector<FolderEntry>> look(bool tables_rest = false,
                                        Clock::time_point now = Clock::now());

 private:
  struct Seen {
    std::string state;
    Clock::time_point since;
  };
  using Place = std::pair<std::uint64_t, std::uint64_t>;  // device and inode
  Result<Place> place() const;

  const std::string folder_;
  std::optional<Place> place_;        // where something was last
  std::map<std::string, Seen> seen_;  // by path
  CatalogTables tables_;
};

/// Once more of what was opened: whoever may write into the folder may have put other files there
/// after they were looked at.
Result<void> stays_in_catalog(const Dataset&, const std::string& catalog);

/// Waits until nothing in the folder was written to within the last kRest, `most` at most: at a
/// start, what was just put there is waited for rather than missed.
void wait_for_rest(const std::string& folder, std::chrono::milliseconds most);

}  // namespace tind::services
