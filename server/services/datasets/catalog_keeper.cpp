// What is wanted is listed first, what is there already is kept, the rest is opened by several
// threads, and only then, when nothing is wrong, the catalog gets the new list in one step.
// Requests hold the datasets that they began with; the last of an old one is let go here, because
// closing files may take its time.

#include "server/services/datasets/catalog_keeper.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <iterator>
#include <set>
#include <utility>

#include "server/services/datasets/open_dataset.h"
#include "terrain/base/caught.h"
#include "terrain/base/parallel.h"
#include "terrain/raster/dem_files.h"
#include "terrain/raster/file_state.h"
#include "terrain/raster/sandbox/decoder.h"
#include "terrain/raster/sandbox/lockdown.h"
#include "terrain/raster/sandboxed_pool.h"

namespace tind::services {
namespace {

using Clock = std::chrono::steady_clock;

// How long it is waited for entries of the folder to be opened: at the start (a server of files
// that does not answer holds up nobody else), by a reload.
constexpr std::chrono::milliseconds kPatienceAtStart{30'000}, kPatienceOfReload{2000};

// What could not be opened for a reason that may pass is tried again, as heights are that could not
// be read: for ever, after pauses that double.
constexpr std::chrono::seconds kFirstPause{1}, kLongestPause{300};

/// Two specs with the same key are opened as the same dataset. A folder of rasters and a list stand
/// for what they hold now.
std::string key_of(const Config& config, const DatasetSpec& spec,
                   const std::vector<std::string>& files) {
  std::string key = config.index_dir + "\n";
  const auto options = dataset_options(config.every, spec.own);
  const bool tiles = is_stored({.name = {}, .files = files});
  const auto held =
      tiles || !options ? Result<DemFiles>(DemFiles{files, {}}) : dem_files(files, options->dem);
  for (const std::string& file : held ? held->files : files) key += file + "\n";
  for (const LayerTable& layer : spec.layers) {
    key += fmt::format("layer {} {}\n", layer.name, fmt::join(layer.files, " "));
    for (const auto& [name, text] : layer.own) key += fmt::format("of it {} {}\n", name, text);
  }
  for (const auto& [name, text] : config.every)
    if (!spec.own.contains(name)) key += fmt::format("every {} {}\n", name, text);
  for (const auto& [name, text] : spec.own) key += fmt::format("own {} {}\n", name, text);
  return key;
}

bool is_as_it_was(const ServedDataset& dataset) {
  return !dataset.unchanged || dataset.unchanged().has_value();
}

/// Its heights could not be read when they were to be; a reload is to try again.
bool has_failed(const ServedDataset& dataset) {
  if (!dataset.tiles) return false;
  const Readiness now = dataset.tiles->readiness();
  return now.state == Readiness::State::failed || now.again_in_s;
}

/// Whether it lies in the files themselves, so that trying again is of no use while they stay as
/// they are.
bool is_of_the_files(const Error& why) {
  constexpr Errc kOfFiles[] = {Errc::bad_data, Errc::unsupported, Errc::invalid_argument,
                               Errc::out_of_range};
  return std::ranges::count(kOfFiles, why.code) > 0 || sandbox::says_crash(why);
}

/// Who has a name: where people find it.
std::string place_of(const DatasetSpec& spec, const std::string& entry) {
  return !entry.empty() ? entry : !spec.where.empty() ? spec.where : spec.files.front();
}

/// Files of geoids that are said to be what heights are above: they are no datasets.
void add_geoids(const SettingTexts& texts, std::set<std::string>& files) {
  std::error_code none;
  for (const std::string& file : named_geoids(texts))
    files.insert(std::filesystem::weakly_canonical(file, none).string());
}

std::set<std::string> geoids_of(const Config& config, const std::vector<FolderEntry>& entries) {
  std::set<std::string> files;
  add_geoids(config.every, files);
  const auto add = [&](const DatasetSpec& spec) {
    add_geoids(spec.own, files);
    for (const LayerTable& layer : spec.layers) add_geoids(layer.own, files);
  };
  for (const DatasetSpec& spec : config.tables) add(spec);
  for (const FolderEntry& entry : entries) add(entry.spec);
  return files;
}

/// Files that tables of the folder name: what is no dataset by itself may be a part of theirs.
std::set<std::string> rasters_of_tables(const std::vector<FolderEntry>& entries) {
  std::set<std::string> files;
  for (const FolderEntry& entry : entries)
    if (entry.is_table)
      for (const std::string& file : files_of(entry.spec).value_or(std::vector<std::string>{}))
        files.insert(file);
  return files;
}

}  // namespace

CatalogKeeper::CatalogKeeper(Catalog& catalog, Settings settings)
    : catalog_(catalog), settings_(std::move(settings)) {}

// --- what is wanted ------------------------------------------------------------------------------

/// What is served already as this one would be opened: under the same name if there are several.
const CatalogKeeper::Wanted* CatalogKeeper::same_as(const Wanted& wanted,
                                                    const std::string& name) const {
  const Wanted* found = nullptr;
  for (const Wanted& here : here_)
    if (here.key == wanted.key && (!found || here.served->name == name)) found = &here;
  return found;
}

std::string CatalogKeeper::changes_of(const Config& config, const DatasetSpec& spec,
                                      const Dataset& dataset) {
  std::vector<std::string> files = named_files(config.every, spec.own);
  for (const LayerTable& layer : spec.layers)
    for (const std::string& file : named_geoids(layer.own)) files.push_back(file);
  const auto& own = dataset.source ? dataset.source->info().files : spec.files;
  files.insert(files.end(), own.begin(), own.end());
  std::string times;
  std::error_code none;
  for (const std::string& file : files)
    if (const auto state = file_state(file); state && std::filesystem::is_regular_file(file, none))
      times += fmt::format("{} ", state->changed_ns);
  return times;
}

/// What has other files by now is opened anew.
void CatalogKeeper::want_configured(const Config& config, std::vector<Wanted>& wanted) const {
  for (DatasetSpec& spec : specs_of(config)) {
    Wanted one{.spec = std::move(spec)};
    if (one.spec.files.empty()) {
      one.wrong = Error{Errc::invalid_argument, "dataset " + one.spec.name + " names no file"};
    } else if (const auto files = files_of(one.spec); !files) {
      one.wrong = files.error();
    } else {
      one.key = key_of(config, one.spec, *files);
      const Wanted* const same = same_as(one, name_of(one.spec));
      if (same && is_as_it_was(*same->served) && !has_failed(*same->served)) {
        one.changes = changes_of(config, one.spec, *same->served);
        const bool was_entry = !same->entry.empty();  // whose state has them
        if (was_entry || one.changes == same->changes) one.served = same->served;
      }
    }
    wanted.push_back(std::move(one));
  }
}

bool CatalogKeeper::has_name(const std::string& name, const std::string& but_entry) const {
  return std::ranges::any_of(here_, [&](const Wanted& here) {
    return here.served->name == name && here.entry != but_entry;
  });
}

bool CatalogKeeper::is_hopeless(const FolderEntry& entry) const {
  const auto left = left_.find(entry.path);
  if (left == left_.end() || left->second.state != entry.state) return false;
  if (left->second.may_pass) return Clock::now() < left->second.again;
  return left->second.name.empty() || has_name(left->second.name, entry.path);
}

/// What was opened while the folder went away, or came back, may have looked like anything.
void CatalogKeeper::try_all_again() {
  for (auto& [entry, left] : left_) left.may_pass = true, left.again = {}, left.pause = {};
}

Result<void> CatalogKeeper::want_folder(const Config& config, bool tables_rest,
                                        std::vector<Wanted>& wanted) {
  const auto entries = folder_->look(tables_rest);
  if (!entries) {
    lost_ = true;
    opener_.keep({});  // what comes of these now is of a folder that went away
    opening_.clear();
    const std::lock_guard lock(mutex_);
    status_.opening.clear();
    return std::unexpected(entries.error());
  }
  if (std::exchange(lost_, false)) try_all_again();
  restless_.clear();
  const std::set<std::string> geoids = geoids_of(config, *entries);
  of_tables_ = rasters_of_tables(*entries);
  std::set<std::string> there;
  std::error_code none;
  for (const FolderEntry& entry : *entries) {
    if (geoids.contains(std::filesystem::weakly_canonical(entry.path, none).string())) continue;
    there.insert(entry.path);
    const auto old = std::ranges::find(here_, entry.path, &Wanted::entry);
    Wanted one{
        .spec = entry.spec, .entry = entry.path, .state = entry.state, .content = entry.content};
    one.is_table = entry.is_table;
    if (old != here_.end()) one.served = old->served;
    if (!entry.wrong.empty()) {
      // What is wrong may be mended without a change of its files.
      if (entry.rests)
        leave_aside(entry.path, entry.wrong,
                    {.state = entry.state + entry.wrong, .may_pass = entry.unread});
      else
        restless_.push_back(entry.path);
      // There is nothing in it any more, unless that is what one cannot see for a while.
      if (!entry.is_table && !entry.unread) one.served = nullptr;
    } else {
      const auto files = files_of(entry.spec);
      one.key = files ? key_of(config, entry.spec, *files) : std::string();
      const bool same = one.served && old->key == one.key && old->content == one.content &&
                        is_as_it_was(*one.served);
      const bool hopeless = is_hopeless(entry);
      if (!entry.rests && !same) restless_.push_back(entry.path);
      if (entry.rests && !same && !hopeless) one.served = nullptr;
      if (entry.rests && !hopeless) {
        // One that is tried again keeps its pause until it can be opened.
        if (const auto left = left_.find(entry.path);
            left != left_.end() && (one.served || left->second.state != entry.state))
          left_.erase(left);
        wanted.push_back(std::move(one));
        continue;
      }
    }
    if (!one.served) continue;  // not yet, or never
    one.key = old->key;         // as it was opened
    one.state = old->state;
    one.content = old->content;
    wanted.push_back(std::move(one));
  }
  std::erase_if(left_, [&](const auto& left) { return !there.contains(left.first); });
  return {};
}

/// Said once for each state of its files, however often it is tried again.
void CatalogKeeper::leave_aside(const std::string& entry, const std::string& why, Left left) {
  const auto found = left_.find(entry);
  const bool known =
      found != left_.end() && found->second.state == left.state && found->second.name == left.name;
  const Left before = known ? found->second : Left{};
  if (left.may_pass) {
    left.pause = std::clamp(2 * before.pause, kFirstPause, kLongestPause);
    left.again = Clock::now() + left.pause;
  }
  const bool in_vain = left.may_pass && before.pause.count() > 0;
  if (!of_tables_.contains(entry)) {
    left.said = why;
    if (!in_vain && left.said != before.said)
      spdlog::warn("catalog: left alone: {}{}", left.said,
                   left.may_pass ? "; it is tried again" : "");
  }
  left_.insert_or_assign(entry, std::move(left));
}

void CatalogKeeper::is_open_now(const std::string& entry) {
  const auto left = left_.find(entry);
  if (left == left_.end()) return;
  if (left->second.pause.count() > 0) spdlog::info("catalog: {}: could be opened now", entry);
  left_.erase(left);
}

void CatalogKeeper::say_what_is_left() {
  std::map<std::string, std::string> aside;
  std::set<std::string> again;
  for (const auto& [entry, left] : left_) {
    if (left.said.empty()) continue;
    aside[entry] = left.said;
    if (left.may_pass) again.insert(entry);
  }
  const std::lock_guard lock(mutex_);
  status_.aside = std::move(aside);
  status_.again = std::move(again);
}

// --- opening -------------------------------------------------------------------------------------

namespace {

/// As the dataset's table says, or what is said of all.
std::string sandbox_of(const SettingTexts& every, const SettingTexts& own) {
  for (const SettingTexts* said : {&own, &every})
    if (const auto found = said->find("sandbox"); found != said->end()) return found->second;
  return dataset_setting("sandbox")->initial;
}

/// A pool whose sources are read as that says.
Result<std::shared_ptr<SourcePool>> pool_for(const std::shared_ptr<SourcePool>& pool,
                                             const std::string& how) {
  if (!pool || how == "off") return without_sandbox(pool);
  if (how != "on") return pool;
  const std::string missing = sandbox::missing_text(sandbox::supported());
  if (missing.empty()) return without_exceptions(pool);
  return fail(Errc::unsupported,
              "sandbox = on: this system lacks " + missing + "; sandbox = auto does without");
}

}  // namespace

Result<DatasetOptions> CatalogKeeper::options_of(const Config& config,
                                                 const DatasetSpec& spec) const {
  auto options = dataset_options(config.every, spec.own);
  if (!options) return options;
  options->dem.environment = settings_.environment;
  auto pool = pool_for(settings_.pool, sandbox_of(config.every, spec.own));
  if (!pool) return std::unexpected(pool.error());
  options->dem.pool = std::move(*pool);
  return options;
}

std::string CatalogKeeper::index_dir(const Config& config) const {
  return settings_.keeps_indexes ? index_dir_of(config.index_dir) : std::string();
}

void CatalogKeeper::open(const Config& config, std::vector<Wanted>& wanted) const {
  std::vector<Wanted*> to_open;
  for (Wanted& one : wanted)
    if (one.entry.empty() && !one.served && !one.wrong) to_open.push_back(&one);
  const std::string indexes = index_dir(config);
  parallel_for(to_open.size(), 0, [&](std::size_t i) {
    Wanted& one = *to_open[i];
    try {
      const auto options = options_of(config, one.spec);
      auto opened = options ? open_dataset(one.spec, *options, indexes)
                            : Result<Dataset>(std::unexpected(options.error()));
      if (opened) {
        one.changes = changes_of(config, one.spec, *opened);
        one.opened = std::move(*opened);
      } else {
        one.wrong = opened.error();
      }
    } catch (const std::exception& error) {
      one.wrong = fail(one.spec.files[0], caught(error)).error();
    }
  });
}

/// Those that take longer than `patience` go on, and are there at a later look.
void CatalogKeeper::open_entries(const Config& config, std::vector<Wanted>& wanted,
                                 std::chrono::milliseconds patience) {
  std::vector<std::pair<Wanted*, std::string>> to_open;
  std::set<std::string> keys;
  for (Wanted& one : wanted) {
    if (one.entry.empty() || one.served || one.wrong) continue;
    to_open.emplace_back(&one, one.entry + "\n" + one.state + one.key);
    keys.insert(to_open.back().second);
  }
  opener_.keep(keys);
  const std::string indexes = index_dir(config);
  for (auto& [one, key] : to_open)
    opener_.begin(
        key,
        [spec = one->spec, indexes, path = one->entry, folder = folder_->folder(),
         is_table = one->is_table, options = options_of(config, one->spec)]() -> Result<Dataset> {
          if (!options) return std::unexpected(options.error());
          if (is_offset_grid(path, options->dem.pool))
            return fail(Errc::unsupported, path +
                                               ": is a grid of geoid heights or offsets, not of "
                                               "terrain; a table can name it as from_datum");
          auto dataset = open_dataset(spec, *options, indexes);
          if (dataset && !is_table)
            if (auto ok = stays_in_catalog(*dataset, folder); !ok)
              return std::unexpected(ok.error());
          return dataset;
        });
  if (to_open.empty()) return;
  const auto begin = Clock::now();
  opener_.wait_until(begin + patience);
  waited_ += std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - begin);
  for (auto& [one, key] : to_open) {
    auto done = opener_.take(key);
    one->under_way = !done;
    if (done && *done)
      one->opened = std::move(**done);
    else if (done)
      one->wrong = done->error();
  }
}

void CatalogKeeper::say_what_takes_long(const std::vector<Wanted>& wanted) {
  std::set<std::string> opening;
  for (const Wanted& one : wanted)
    if (one.under_way) opening.insert(one.entry);
  constexpr std::chrono::seconds kLong{2};
  const auto now = Clock::now();
  std::erase_if(opening_, [&](const auto& one) { return !opening.contains(one.first); });
  for (const std::string& entry : opening) {
    Opening& one = opening_.try_emplace(entry, Opening{now}).first->second;
    if (now - one.since < kLong || std::exchange(one.said, true)) continue;
    spdlog::info("catalog: {}: takes long to open; what else there is does not wait for it", entry);
  }
  const std::lock_guard lock(mutex_);
  status_.opening = std::move(opening);
}

// --- putting it there ----------------------------------------------------------------------------

CatalogChange CatalogKeeper::put(std::vector<Wanted> wanted) {
  std::map<std::string, std::string> names;  // and who has them
  // Names that tables give are theirs.
  for (const Wanted& one : wanted)
    if (one.entry.empty() && !one.spec.where.empty() && !one.spec.name.empty())
      names[one.spec.name] = place_of(one.spec, one.entry);
  const auto taken = [&](const std::string& name) { return names.contains(name); };
  // And who has one keeps it: a newcomer to the folder takes nobody's.
  std::map<std::string, std::string> kept;  // entries by name
  for (const Wanted& old : here_)
    if (!old.entry.empty() && std::ranges::find(wanted, old.entry, &Wanted::entry) != wanted.end())
      kept[old.served->name] = old.entry;
  std::vector<Wanted> here;
  std::vector<const Wanted*> opened;
  here.reserve(wanted.size());
  for (Wanted& one : wanted) {
    const bool has_own = one.entry.empty() && !one.spec.where.empty() && !one.spec.name.empty();
    const std::string name = has_own ? one.spec.name : safe_name(name_of(one.spec));
    const auto keeper = kept.find(name);
    const bool of_other = keeper != kept.end() && keeper->second != one.entry;
    if (!one.entry.empty() && (taken(name) || of_other)) {
      leave_aside(one.entry,
                  fmt::format("{}: its name, {}, is that of {}; rename one of them", one.entry,
                              name, taken(name) ? names[name] : keeper->second),
                  {.state = one.state, .name = name});
      continue;
    }
    const std::string unique = has_own ? name : free_name(name, taken);
    names[unique] = place_of(one.spec, one.entry);
    const bool is_new = !one.served;
    if (is_new)
      one.served = catalog_.make(unique, std::move(*one.opened));
    else if (one.served->name != unique)
      one.served = catalog_.make(unique, Dataset(*one.served));
    one.opened.reset();
    if (is_new) is_open_now(one.entry);
    here.push_back(std::move(one));
    if (is_new) opened.push_back(&here.back());
  }
  CatalogChange change;
  Catalog::Datasets datasets;
  std::map<std::string, std::shared_ptr<const ServedDataset>> before;
  for (const Wanted& old : here_) before[old.served->name] = old.served;
  for (const Wanted& one : here) {
    const auto old = before.find(one.served->name);
    if (old == before.end())
      change.added.push_back(one.served->name);
    else if (old->second != one.served)
      change.replaced.push_back(one.served->name);
    else
      ++change.kept;
    datasets.push_back(one.served);
    if (old != before.end() && old->second == one.served) before.erase(old);
  }
  for (auto& [name, old] : before) {
    if (std::ranges::find(change.replaced, name) == change.replaced.end())
      change.removed.push_back(name);
    retired_.push_back(std::move(old));
  }
  catalog_.replace(std::move(datasets));
  for (const Wanted* one : opened)
    if (settings_.opened) settings_.opened(*one->served, *options_of(config_, one->spec));
  here_ = std::move(here);
  say_what_is_left();
  const std::lock_guard lock(mutex_);
  for (const std::string& name : change.replaced) status_.unlike.erase(name);
  return change;
}

std::expected<CatalogChange, CatalogKeeper::Reasons> CatalogKeeper::gather(
    const Config& config, bool look, std::chrono::milliseconds patience) {
  std::vector<Wanted> wanted;
  if (look)
    want_configured(config, wanted);
  else
    std::ranges::copy_if(here_, std::back_inserter(wanted), &std::string::empty, &Wanted::entry);
  if (folder_)
    if (auto done = want_folder(config, look, wanted); !done)
      return std::unexpected(Reasons{done.error()});
  open(config, wanted);
  open_entries(config, wanted, patience);
  say_what_takes_long(wanted);
  Reasons reasons;
  for (Wanted& one : wanted) {
    if (!one.wrong && !one.under_way) continue;
    if (one.entry.empty()) {
      reasons.push_back(*one.wrong);
      continue;
    }
    if (one.wrong)
      leave_aside(one.entry, one.wrong->what,
                  {.state = one.state, .may_pass = !is_of_the_files(*one.wrong)});
    const auto old = std::ranges::find(here_, one.entry, &Wanted::entry);
    if (old == here_.end()) continue;
    one = *old;  // what there was stays
  }
  say_what_is_left();
  if (!reasons.empty()) return std::unexpected(std::move(reasons));
  std::erase_if(wanted, [](const Wanted& one) { return !one.served && !one.opened; });
  const bool same = std::ranges::equal(wanted, here_, [](const Wanted& a, const Wanted& b) {
    return a.served && a.served == b.served && name_of(a.spec) == name_of(b.spec);
  });
  if (same && !look) return CatalogChange{.kept = here_.size()};
  return put(std::move(wanted));
}

std::expected<CatalogChange, CatalogKeeper::Reasons> CatalogKeeper::load() {
  const auto config = settings_.read();
  if (!config) return std::unexpected(Reasons{config.error()});
  if (auto any = something_to_serve(*config); !any) return std::unexpected(Reasons{any.error()});
  auto old_folder = folder_;
  left_.clear();  // what was left alone gets another chance
  restless_.clear();
  if (config->catalog.empty())
    folder_ = nullptr;
  else if (!folder_ || folder_->folder() != config->catalog)
    folder_ = std::make_shared<CatalogFolder>(config->catalog);
  const Config old_config = std::exchange(config_, *config);
  auto change = gather(config_, true, loaded_ ? kPatienceOfReload : kPatienceAtStart);
  if (!change) {
    config_ = old_config;
    folder_ = std::move(old_folder);
    return change;
  }
  {
    const std::lock_guard lock(mutex_);
    change->aside = status_.aside;
    change->waiting.assign(status_.opening.begin(), status_.opening.end());
  }
  change->waiting.insert(change->waiting.end(), restless_.begin(), restless_.end());
  if (settings_.taken) settings_.taken(config_);
  if (std::exchange(loaded_, true)) {
    change->for_restart = settings_for_restart(running_, config_);
  } else {
    running_ = config_;
  }
  return change;
}

}  // namespace tind::services
