// What the keeper does while the daemon runs: reloads, and looks at what has changed.

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <ctime>
#include <exception>
#include <utility>

#include "server/log/printable.h"
#include "server/services/datasets/catalog_keeper.h"
#include "terrain/base/caught.h"
#include "terrain/raster/file_state.h"

namespace tind::services {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook{1000};  // between two looks, where one takes little time
constexpr int kPause = 20;                        // else so many times as long as one took
constexpr std::chrono::milliseconds kPatienceOfLook{300};  // with entries that are being opened

std::unexpected<Error> stopping() { return fail(Errc::cancelled, "the server is shutting down"); }

std::string now_text() { return fmt::format("{:%FT%TZ}", fmt::gmtime(std::time(nullptr))); }

std::string text_of(const CatalogChange& change, std::size_t all) {
  std::string text = fmt::format("{} datasets", all);
  const auto add = [&](const char* what, const std::vector<std::string>& names) {
    if (!names.empty()) text += fmt::format("; {}: {}", what, fmt::join(names, ", "));
  };
  add("new", change.added);
  add("opened anew", change.replaced);
  add("gone", change.removed);
  add("only a restart changes", change.for_restart);
  add("not at rest yet", change.waiting);
  return text;
}

/// In a folder that is a catalog, nobody need do anything.
std::string what_became(std::string why, bool of_folder) {
  const auto remedy = why.find(kChangedRemedy);
  if (of_folder && remedy != why.npos)
    why.replace(remedy, kChangedRemedy.size(), "; it is opened anew once its files rest");
  return why;
}

}  // namespace

void CatalogKeeper::reload(Done done) {
  std::unique_lock lock(mutex_);
  if (ended_) {
    lock.unlock();
    if (done) done(stopping());
    return;
  }
  if (done) waiting_.push_back(std::move(done));
  asked_ = true;
  wake_.notify_all();
}

/// What nobody foresaw ends none of what is served.
void CatalogKeeper::try_to(void (CatalogKeeper::*step)()) try {
  (this->*step)();
} catch (const std::exception& error) {
  if (unforeseen_.take(error.what())) spdlog::error("catalog: {}", error.what());
}

/// The same of a load: it has failed.
std::expected<CatalogChange, CatalogKeeper::Reasons> CatalogKeeper::load_whatever_is_there() try {
  return load();
} catch (const std::exception& error) {
  return std::unexpected(Reasons{caught(error)});
}

void CatalogKeeper::reload_now(std::vector<Done> waiting) {
  try_to(&CatalogKeeper::follow_tiles);
  const auto change = load_whatever_is_there();
  std::string why;
  if (change) {
    spdlog::info("reloaded: {}", text_of(*change, here_.size()));
  } else {
    for (const Error& reason : change.error()) {
      spdlog::error("reload: {}", reason.what);
      why += (why.empty() ? "" : "; ") + reason.what;
    }
    spdlog::error("the reload failed: the {} datasets that there were stay", here_.size());
  }
  try_to(&CatalogKeeper::look_at_files);
  {
    const std::lock_guard lock(mutex_);
    ++(change ? status_.reloads : status_.failed_reloads);
    status_.when = now_text();
    status_.wrong = change ? std::nullopt : std::optional(why);
  }
  for (Done& done : waiting)
    done(change ? Result<CatalogChange>(*change) : fail(change.error()[0].code, why));
}

/// Folders of tiles that were updated.
void CatalogKeeper::follow_tiles() {
  for (const std::string& name : catalog_.follow()) {
    spdlog::info("{}: its folder has got other tiles, which are served from now on", name);
    const auto here =
        std::ranges::find_if(here_, [&](const Wanted& one) { return one.served->name == name; });
    if (here == here_.end()) continue;
    retired_.push_back(std::exchange(here->served, catalog_.find(name)));
    if (here->entry.empty()) here->changes = changes_of(config_, here->spec, *here->served);
  }
}

void CatalogKeeper::follow_folder() {
  if (!folder_) return;
  const auto change = gather(config_, false, kPatienceOfLook);
  if (!change) {
    // Not the folder's entries, but the folder itself.
    const std::string why = change.error()[0].what;
    const std::lock_guard lock(mutex_);
    if (std::exchange(status_.lost, why) != why) spdlog::error("catalog: {}", why);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    if (std::exchange(status_.lost, std::nullopt))
      spdlog::info("catalog: {} is there again", folder_->folder());
  }
  if (change->any()) spdlog::info("catalog: {}", text_of(*change, here_.size()));
}

/// Says once what became of a dataset's files, and once that they are back.
void CatalogKeeper::look_at_files() {
  std::map<std::string, std::string> unlike;
  for (const Wanted& one : here_) {
    if (!one.served->unchanged) continue;
    if (const auto same = one.served->unchanged(); !same)
      unlike[one.served->name] = what_became(same.error().what, !one.entry.empty());
  }
  std::map<std::string, std::string> before;
  {
    const std::lock_guard lock(mutex_);
    before = std::exchange(status_.unlike, unlike);
  }
  for (const auto& [name, why] : unlike)
    if (!before.contains(name))
      spdlog::warn("{}: {}; what needs reading it again answers 503", name, why);
  const auto is_here = [&](const std::string& name) {
    return std::ranges::any_of(here_, [&](const Wanted& one) { return one.served->name == name; });
  };
  for (const auto& [name, why] : before)
    if (!unlike.contains(name) && is_here(name))
      spdlog::info("{}: its files are as they were opened", name);
}

/// Says why heights could not be read when that was tried, once for each reason.
void CatalogKeeper::look_at_reading() {
  std::map<std::string, std::string> wrong;
  for (const Wanted& one : here_)
    if (one.served->tiles)
      if (const Readiness now = one.served->tiles->readiness(); !now.why.empty()) {
        const bool again = now.state == Readiness::State::reading;
        wrong[one.served->name] =
            now.why + (again ? "; it is tried again" : "; a reload tries it again");
      }
  std::map<std::string, std::string> before;
  {
    const std::lock_guard lock(mutex_);
    before = std::exchange(status_.unread, wrong);
  }
  for (const auto& [name, why] : wrong)
    if (const auto said = before.find(name); said == before.end() || said->second != why)
      spdlog::error("{}: its heights cannot be made ready: {}", name, logging::printable(why));
  for (const auto& [name, why] : before)
    if (!wrong.contains(name)) spdlog::info("{}: its heights are ready, or it is gone", name);
}

void CatalogKeeper::drop_retired() {
  std::erase_if(retired_, [](const auto& dataset) { return dataset.use_count() == 1; });
}

void CatalogKeeper::run(const std::stop_token& stop) {
  std::chrono::milliseconds pause = kLook;
  while (!stop.stop_requested()) {
    std::vector<Done> waiting;
    bool asked = false;
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, stop, pause, [&] { return asked_; });
      asked = std::exchange(asked_, false);
      waiting.swap(waiting_);
    }
    if (stop.stop_requested()) {
      for (Done& done : waiting) done(stopping());
      break;
    }
    const auto begin = Clock::now();
    waited_ = {};
    if (asked) {
      reload_now(std::move(waiting));
    } else {
      for (const auto step : {&CatalogKeeper::follow_tiles, &CatalogKeeper::follow_folder,
                              &CatalogKeeper::look_at_files, &CatalogKeeper::look_at_reading})
        try_to(step);
    }
    drop_retired();
    const auto took =
        std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - begin) - waited_;
    pause = asked ? kLook : std::max(kLook, kPause * took);
  }
  std::vector<Done> waiting;
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    waiting.swap(waiting_);
  }
  for (Done& done : waiting) done(stopping());
}

CatalogKeeper::Status CatalogKeeper::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

}  // namespace tind::services
