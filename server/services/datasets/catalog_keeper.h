#pragma once
// Fills the catalog from what the operator says, and keeps it so while the daemon runs: reads the
// configuration anew when told to, follows a folder that is a catalog and folders of tiles that are
// updated, and looks whether the files of the others are as they were.
//
// A reload is all or nothing: while anything that the configuration names is wrong, what is served
// stays. What it names as before, of files that are as they were, is kept, with all that is cached
// of it. Of a catalog's folder each entry stands for itself: what cannot be opened is left aside,
// and what takes long to open holds up nothing else.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <expected>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "server/log/log_limiter.h"
#include "server/services/datasets/catalog.h"
#include "server/services/datasets/catalog_folder.h"
#include "server/services/datasets/config.h"
#include "server/services/datasets/opener.h"
#include "terrain/base/result.h"
#include "terrain/geo/environment.h"
#include "terrain/raster/dem_source.h"

namespace tind::services {

/// What came of putting the catalog together.
struct CatalogChange {
  std::size_t kept = 0;
  std::vector<std::string> added = {}, replaced = {}, removed = {};  // names
  std::vector<std::string> for_restart = {};                         // settings that need one
  std::map<std::string, std::string> aside = {};  // entries of the folder that are left alone, why
  std::vector<std::string> waiting = {};          // entries that are not at rest, or being opened
  bool any() const { return !added.empty() || !replaced.empty() || !removed.empty(); }
};

class CatalogKeeper {
 public:
  struct Settings {
    /// The configuration as it is now: not on an I/O thread.
    std::function<Result<Config>()> read;
    std::shared_ptr<const Environment> environment;
    std::shared_ptr<SourcePool> pool;
    /// Called for each dataset that was opened, with its options, from the thread that opened it.
    std::function<void(const ServedDataset&, const DatasetOptions&)> opened = {};
    /// Called with each configuration that counts from now on.
    std::function<void(const Config&)> taken = {};
    /// Residual indexes, on disk: who only looks leaves nothing behind.
    bool keeps_indexes = true;
  };
  /// The catalog outlives it.
  CatalogKeeper(Catalog& catalog, Settings settings);

  /// Every reason why the catalog could not be put together.
  using Reasons = std::vector<Error>;
  /// Reads the configuration and puts the catalog together, on this thread and others. For the
  /// start, or on the thread that runs.
  std::expected<CatalogChange, Reasons> load();

  using Done = std::move_only_function<void(Result<CatalogChange>)>;
  /// From any thread, also before run(): load() on the thread that runs; `done` is called there.
  /// Who asks while one is under way gets another one, and all who ask meanwhile the same.
  void reload(Done done = {});

  /// Until it is told to stop.
  void run(const std::stop_token&);

  struct Status {
    std::uint64_t reloads = 0, failed_reloads = 0;
    std::optional<std::string> wrong;           // with the last reload
    std::string when;                           // that was, "2026-11-22T16:00:00Z"
    std::optional<std::string> lost;            // why the catalog's folder cannot be looked into
    std::map<std::string, std::string> unlike;  // datasets whose files have changed, and how
    std::map<std::string, std::string> unread;  // datasets whose heights are not ready, and why
    std::map<std::string, std::string> aside;  // entries of the folder that are not served, and why
    std::set<std::string> again;               // of these, those that are tried again by themselves
    std::set<std::string> opening;             // entries that take long to open, and go on
  };
  Status status() const;

 private:
  static constexpr int kOpeners = 4;  // entries of the folder that are opened at a time

  /// One dataset that is to be there.
  struct Wanted {
    DatasetSpec spec;
    std::string key = {};      // of files and options
    std::string changes = {};  // of the files, where the configuration names them
    std::string entry = {};    // of the catalog's folder; empty: of the configuration
    std::string state = {};    // of the entry
    std::string content = {};  // of the entry without its table
    bool is_table = false;     // the entry is
    bool under_way = false;    // is being opened still
    std::shared_ptr<const ServedDataset> served = nullptr;  // null: is to be opened
    std::optional<Dataset> opened = {};
    std::optional<Error> wrong = {};
  };

  /// When the inode of each file that it is made of was last changed. Rights and links change that,
  /// too; but so does who writes into a file and sets its old time again (cp -p, rsync --inplace),
  /// which nothing else tells. Files of other machines have none.
  static std::string changes_of(const Config&, const DatasetSpec&, const Dataset&);
  void want_configured(const Config&, std::vector<Wanted>&) const;
  Result<void> want_folder(const Config&, bool tables_rest, std::vector<Wanted>&);
  const Wanted* same_as(const Wanted&, const std::string& name) const;
  void open(const Config&, std::vector<Wanted>&) const;
  void open_entries(const Config&, std::vector<Wanted>&, std::chrono::milliseconds patience);
  void say_what_takes_long(const std::vector<Wanted>&);
  CatalogChange put(std::vector<Wanted>);
  std::expected<CatalogChange, Reasons> gather(const Config&, bool look,
                                               std::chrono::milliseconds patience);
  std::expected<CatalogChange, Reasons> load_whatever_is_there();
  void try_to(void (CatalogKeeper::*step)());
  void reload_now(std::vector<Done>);
  void follow_tiles();
  void follow_folder();
  void look_at_files();
  void look_at_reading();
  void drop_retired();
  struct Left;
  void leave_aside(const std::string& entry, const std::string& why, Left);
  void try_all_again();
  void is_open_now(const std::string& entry);
  void say_what_is_left();
  bool is_hopeless(const FolderEntry&) const;
  bool has_name(const std::string& name, const std::string& but_entry) const;
  Result<DatasetOptions> options_of(const Config&, const DatasetSpec&) const;
  std::string index_dir(const Config&) const;

  Catalog& catalog_;
  const Settings settings_;

  // Of the thread that runs.
  Config config_, running_;  // of the last load that went well, of the first
  bool loaded_ = false;
  std::vector<Wanted> here_;  // what is served, in its order
  std::shared_ptr<CatalogFolder> folder_;
  /// An entry that was left aside: until its files change; where another has its name, until that
  /// goes; where the reason may pass, until it is tried again.
  struct Left {
    std::string state, name = {};
    bool may_pass = false;
    std::chrono::steady_clock::time_point again = {};  // then, after such a pause
    std::chrono::seconds pause{0};
    std::string said = {};  // why; empty: it is served as a part of a table's dataset
  };
  std::map<std::string, Left> left_;  // by entry
  bool lost_ = false;                 // the folder was, at the last look
  struct Opening {
    std::chrono::steady_clock::time_point since;
    bool said = false;  // that it takes long
  };
  std::map<std::string, Opening> opening_;  // by entry
  std::vector<std::string> restless_;       // entries that were not at rest at the last look
  std::set<std::string> of_tables_;         // files that tables of the folder name
  Catalog::Datasets retired_;               // requests may have them still
  logging::LogLimiter unforeseen_{std::chrono::minutes(10), 16};  // of looks, every few seconds
  std::chrono::milliseconds waited_{0};                           // for the opener, in this turn

  mutable std::mutex mutex_;  // of these
  std::condition_variable_any wake_;
  bool asked_ = false, ended_ = false;
  std::vector<Done> waiting_;
  Status status_;

  Opener opener_{kOpeners};  // last: it ends before what it works on
};

}  // namespace tind::services
