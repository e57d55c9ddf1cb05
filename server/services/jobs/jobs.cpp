#include "server/services/jobs/jobs.h"

#include <spdlog/spdlog.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "server/log/printable.h"
#include "server/services/jobs/job_folders.h"
#include "server/services/jobs/job_messages.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/random_bytes.h"

namespace tind::services {
namespace {

namespace fs = std::filesystem;

constexpr auto kSweep = std::chrono::minutes(1);
constexpr const char* kAboutToEnd = "the daemon is about to end";
constexpr std::size_t kMostEnded = 1000;  // of a client, that have no result
// What those that wait were given, which lies in the list: of all, of a client.
constexpr std::uint64_t kMostOrders = 256u << 20, kMostOrdersOfClient = 64u << 20;

/// 128 bits from the system, which nobody guesses.
Result<std::string> new_id() {
  std::uint8_t bytes[16];
  if (auto made = random_bytes(bytes); !made) return std::unexpected(made.error());
  std::string id;
  for (const std::uint8_t b : bytes) {
    constexpr char kDigits[] = "0123456789abcdef";
    id += kDigits[b >> 4];
    id += kDigits[b & 15];
  }
  return id;
}

}  // namespace

Result<std::unique_ptr<Jobs>> Jobs::open(const std::string& folder, const std::string& program,
                                         const JobLimits& limits) {
  auto where = folder.empty() ? make_temporary_jobs_folder() : make_jobs_folder(folder);
  if (!where) return std::unexpected(where.error());
  auto store = JobStore::open(list_in(*where));
  if (!store) return std::unexpected(store.error());
  std::unique_ptr<Jobs> jobs(
      new Jobs(std::move(*where), folder.empty(), program, limits, std::move(*store)));
  if (auto recovered = jobs->recover(); !recovered) return std::unexpected(recovered.error());
  jobs->count_stored();
  for (int i = 0; i < std::max(1, limits.running); ++i)
    jobs->threads_.emplace_back(
        [self = jobs.get()](const std::stop_token& stop) { self->work(stop); });
  return jobs;
}

Jobs::Jobs(std::string folder, bool temporary, std::string program, const JobLimits& limits,
           std::unique_ptr<JobStore> store)
    : folder_(std::move(folder)),
      program_(std::move(program)),
      temporary_(temporary),
      limits_(limits),
      store_(std::move(store)) {}

Jobs::~Jobs() {
  stop();
  if (!temporary_) return;
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

void Jobs::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    for (auto& [id, live] : live_) live->stop.request_stop();
  }
  for (std::jthread& thread : threads_) thread.request_stop();
  threads_.clear();
  // What is in the queue is nobody's; the rest of live_ is somebody's who is about to end it.
  std::vector<std::pair<std::shared_ptr<Live>, Done>> waiting;
  {
    const std::lock_guard lock(mutex_);
    for (const std::string& id : queue_) {
      auto live = live_.extract(id).mapped();
      Done done = std::move(live->done);
      waiting.emplace_back(std::move(live), std::move(done));
    }
    queue_.clear();
    counts_.waiting = 0;
  }
  for (auto& [live, done] : waiting)
    if (done) {
      done(live->job);
      call_off(live->job);
      if (const auto kept = store_->put(live->job); !kept)
        spdlog::error("job {}: {}", live->job.id, logging::printable(kept.error().what));
    }
}

std::string Jobs::folder_of(std::string_view id) const { return folder_ + "/" + std::string(id); }

std::string Jobs::path_of(const Job& job, const JobOrder::Output& output) const {
  return folder_of(job.id) + "/" + output.file;
}

Result<bool> Jobs::is_whole(const Job& job) const {
  const auto there = bytes_in(folder_of(job.id));
  if (!there && there.error().code == Errc::not_found) return false;
  if (!there) return std::unexpected(there.error());
  return *there == job.bytes;
}

/// What is on the list and not at its end is queued again; folders that it does not know go.
Result<void> Jobs::recover() {
  auto left = store_->unfinished();
  if (!left) return std::unexpected(left.error());
  for (Job& job : *left) {
    const auto live = std::make_shared<Live>();
    live->job = std::move(job);
    if (live->job.attempts >= Job::kMostAttempts) {
      end(live, JobStatus::failed, "the daemon ended while this ran, twice: it is not tried again");
      continue;
    }
    live->order_bytes = live->job.bytes;
    live->job.bytes = 0;
    live->job.status = JobStatus::accepted;
    live->job.progress = 0;
    queue_.push_back(live->job.id);
    live_.emplace(live->job.id, live);
    ++counts_.waiting;
  }
  std::set<std::string> clients;
  for (const auto& [id, live] : live_) clients.insert(live->job.client);
  for (const std::string& client : clients) count_stored_of(client);
  remove_unknown_jobs(folder_, *store_);
  return {};
}

std::optional<Error> Jobs::no_room(const Live& one) const {
  const auto busy = [](std::string what) { return Error{Errc::busy, std::move(what)}; };
  std::size_t waiting = 0, of_client = 0;
  std::uint64_t orders = one.order_bytes, orders_of_client = one.order_bytes;
  for (const auto& [id, live] : live_) {
    const bool same = live->job.client == one.job.client;
    waiting += !live->running;
    of_client += same;
    orders += live->order_bytes;
    orders_of_client += same ? live->order_bytes : 0;
  }
  if (of_client >= limits_.per_client)
    return busy("you have " + std::to_string(of_client) +
                " jobs that wait or run, as many as one client may: wait for one, or dismiss one");
  if (waiting >= limits_.waiting)
    return busy(std::to_string(waiting) + " jobs wait already, as many as may: try again later");
  if (orders > kMostOrders || orders_of_client > kMostOrdersOfClient)
    return busy("the jobs that wait were given as much as may wait: try again later");
  // Of those that run none is stored yet, and they end: this one waits for them (may_begin()).
  if (stored_bytes_ + lent_.bytes() + limits_.each.file_bytes > limits_.stored_bytes)
    return busy(kNoRoomForResults);
  return {};
}

/// Beside those that run, whose results may be as large as results may. Under the mutex.
bool Jobs::may_begin() const {
  return counts_.running == 0 ||
         stored_bytes_ + lent_.bytes() + (counts_.running + 1) * limits_.each.file_bytes <=
             limits_.stored_bytes;
}

/// The same of one client's results, of which it may have as many. Under the mutex.
bool Jobs::may_begin_of(const std::string& client) const {
  const auto running = std::ranges::count_if(live_, [&](const auto& one) {
    return one.second->running && one.second->job.client == client;
  });
  const auto stored = stored_of_.find(client);
  return running == 0 || (stored == stored_of_.end() ? 0 : stored->second) +
                                 lent_.bytes_of(client) +
                                 (std::uint64_t(running) + 1) * limits_.each.file_bytes <=
                             limits_.stored_per_client;
}

/// Not under the mutex, as count_stored().
void Jobs::count_stored_of(const std::string& client) {
  const auto stored = store_->bytes_of(client);
  const std::lock_guard lock(mutex_);
  if (stored) stored_of_[client] = *stored;
  std::erase_if(stored_of_, [&](const auto& one) {
    return std::ranges::none_of(live_,
                                [&](const auto& l) { return l.second->job.client == one.first; });
  });
}

/// Not under the mutex: the list may be waiting for its disk.
void Jobs::count_stored() {
  if (const auto stored = store_->total_bytes()) stored_bytes_ = *stored;
}

/// As unwritable(), but now.
int Jobs::in_the_way() const {
  if (::access(folder_.c_str(), R_OK | W_OK | X_OK) != 0) return errno;
  const auto in_place = store_->is_in_place();
  if (!in_place) return in_place.error();
  if (!*in_place) return kOtherList;
  constexpr std::uint64_t kLeast = 256 << 10;  // for the list alone
  struct statvfs disk {};
  const bool full = ::statvfs(folder_.c_str(), &disk) == 0 && disk.f_blocks > 0 &&
                    disk.f_bavail * disk.f_frsize < kLeast;
  return full ? ENOSPC : 0;
}

Result<void> Jobs::can_keep() {
  const int code = in_the_way();
  unwritable_ = code;
  if (code == 0) return {};
  if (code == kOtherList)
    return fail(Errc::io, "the list of jobs in " + folder_ +
                              " is no longer the one that this daemon opened: put it back, or "
                              "restart the daemon");
  return fail(Errc::io, "the folder of jobs, " + folder_ + ": " + errno_text(code));
}

Result<Job> Jobs::submit(const JobOrder& order, Done done, std::stop_token gone,
                         Unchanged unchanged) {
  if (auto there = can_keep(); !there) return std::unexpected(there.error());
  auto id = new_id();
  if (!id) return std::unexpected(id.error());
  const auto live = std::make_shared<Live>();
  Job& job = live->job;
  job.id = std::move(*id);
  job.process = order.process, job.client = order.client;
  JobOrder kept_order = order;
  kept_order.waited_for = done != nullptr;
  for (const auto& [path, name] : order.names)
    if (std::string state = state_of_source(path); !state.empty())
      kept_order.sources[path] = std::move(state);
  auto text = text_of(kept_order);
  if (!text) return std::unexpected(text.error());
  live->order_bytes = text->size();
  job.order = std::make_shared<const std::string>(std::move(*text));
  job.created_ms = job.updated_ms = now_ms();
  live->done = std::move(done);
  live->unchanged = std::move(unchanged);
  drop_left();
  count_stored();
  const auto own = store_->bytes_of(order.client);
  if (own &&
      *own + lent_.bytes_of(order.client) + limits_.each.file_bytes > limits_.stored_per_client)
    return fail(Errc::busy, kNoRoomForYourResults);
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) return fail(Errc::busy, kAboutToEnd);
    if (auto full = no_room(*live)) return std::unexpected(*full);
    live_.emplace(job.id, live);  // has its place; nobody begins it yet
    if (own) stored_of_[order.client] = *own;
  }
  const auto give_up = [&](Error error) -> Result<Job> {
    const std::lock_guard lock(mutex_);
    live_.erase(job.id);
    return std::unexpected(std::move(error));
  };
  if (auto kept = store_->put(job); !kept) return give_up(kept.error());
  live->gone.emplace(std::move(gone), Live::Leave{live.get()});  // it may have gone already
  const std::lock_guard lock(mutex_);
  job.order = nullptr;  // whoever runs it reads it
  Job copy = job;
  if (stopping_) {  // meanwhile, and nobody takes it from the queue any more
    live_.erase(copy.id);
    (void)store_->remove(copy.id);
    return fail(Errc::busy, kAboutToEnd);
  }
  queue_.push_back(copy.id);
  ++counts_.waiting;
  wake_.notify_one();
  return copy;
}

/// Those that wait and that nobody waits for any more give their places.
void Jobs::drop_left() {
  std::vector<std::shared_ptr<Live>> left;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(queue_, [&](const std::string& id) {
      const std::shared_ptr<Live>& live = live_.find(id)->second;
      if (live->dismissed) left.push_back(live);
      return live->dismissed.load();
    });
    counts_.waiting -= left.size();
  }
  for (const auto& live : left) end(live, JobStatus::dismissed, "dismissed");
}

/// As clients are told of it: one that they do not want any more does not run for them, either.
Job Jobs::seen(const Live& live) {
  Job job = live.job;
  if (live.dismissed) job.status = JobStatus::dismissed, job.message = "dismissed";
  return job;
}

Result<std::optional<Job>> Jobs::find(std::string_view id) const {
  {
    const std::lock_guard lock(mutex_);
    if (const auto live = live_.find(id); live != live_.end()) return seen(*live->second);
    if (const auto ended = unsaved_.find(id); ended != unsaved_.end()) return ended->second;
  }
  return store_->find(id);
}

Result<std::vector<Job>> Jobs::of_client(std::string_view client, std::size_t most) const {
  auto all = store_->of_client(client, most);
  if (!all) return all;
  const std::lock_guard lock(mutex_);
  for (Job& job : *all)  // the list does not know how far they are
    if (const auto live = live_.find(job.id); live != live_.end())
      job = seen(*live->second);
    else if (const auto ended = unsaved_.find(job.id); ended != unsaved_.end())
      job = ended->second;
  return all;
}

Result<std::optional<Job>> Jobs::dismiss(std::string_view id) {
  std::shared_ptr<Live> live;
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = live_.find(id); found != live_.end()) {
      live = found->second;
      live->dismissed = true;
      live->stop.request_stop();
      if (std::erase(queue_, live->job.id) == 0)
        return seen(*live);  // whoever runs it ends it, soon
      --counts_.waiting;
    }
  }
  if (!live) {
    auto stored = store_->find(id);
    if (!stored || !*stored || (*stored)->status == JobStatus::dismissed) return stored;
    live = std::make_shared<Live>();
    live->job = **stored;
  }
  end(live, JobStatus::dismissed, "dismissed");
  return live->job;
}

Jobs::Counts Jobs::counts() const {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  const std::lock_guard last(last_mutex_);
  if (lock) last_ = counts_;
  return last_;
}

/// Clients take turns: the oldest job of the one whose last turn is longest ago, of those whose
/// results have room. The end: none may begin. Under the mutex.
std::vector<std::string>::iterator Jobs::next_in_queue() {
  if (!may_begin()) return queue_.end();
  auto first = queue_.end();
  std::uint64_t earliest = 0;
  for (auto id = queue_.begin(); id != queue_.end(); ++id) {
    const std::string& client = live_.find(*id)->second->job.client;
    const auto found = turns_.find(client);
    const std::uint64_t turn = found == turns_.end() ? 0 : found->second;
    if ((first != queue_.end() && turn >= earliest) || !may_begin_of(client)) continue;
    first = id, earliest = turn;
  }
  return first;
}

/// Begins it. Under the mutex.
std::shared_ptr<Jobs::Live> Jobs::take(std::vector<std::string>::iterator first) {
  const std::shared_ptr<Live> live = live_.find(*first)->second;
  turns_[live->job.client] = ++turn_;  // may lack memory: before anything has changed
  queue_.erase(first);
  std::erase_if(turns_, [&](const auto& turn) {  // of whoever has none that waits or runs
    return std::ranges::none_of(
        live_, [&](const auto& one) { return one.second->job.client == turn.first; });
  });
  live->running = true;
  --counts_.waiting, ++counts_.running;
  return live;
}

void Jobs::work(const std::stop_token& stop) {
  auto swept = std::chrono::steady_clock::time_point::min();
  while (!stop.stop_requested()) {
    std::shared_ptr<Live> live;
    {
      std::unique_lock lock(mutex_);
      auto first = queue_.end();
      wake_.wait_for(lock, stop, kSweep, [&] { return (first = next_in_queue()) != queue_.end(); });
      if (stop.stop_requested()) return;
      if (first != queue_.end()) live = take(first);
    }
    if (live) run(live, stop);
    if (const auto now = std::chrono::steady_clock::now(); now - kSweep > swept) {
      swept = now;
      sweep();
    }
  }
}

void Jobs::forget(const Job& job) {
  {
    const std::lock_guard lock(mutex_);
    unsaved_.erase(job.id);
  }
  std::error_code ignored;
  fs::remove_all(folder_of(job.id), ignored);
  lent_.removed(job.id);
  (void)store_->remove(job.id);
  count_stored();
  count_stored_of(job.client);
}

void Jobs::sweep() {
  if (const auto can = can_keep(); !can) spdlog::warn("{}", logging::printable(can.error().what));
  {  // under the mutex: what is dismissed or forgotten meanwhile must not come back
    const std::lock_guard lock(mutex_);
    std::erase_if(unsaved_,
                  [this](const auto& one) { return store_->put(one.second).has_value(); });
  }
  (void)store_->keep_latest(kMostEnded);
  // A clock that was set makes nothing old: what is forgotten does not come back with it.
  constexpr std::chrono::milliseconds kStep = std::chrono::minutes(10);
  const auto here = std::chrono::steady_clock::now();
  const std::int64_t now = now_ms();
  const auto passed = std::chrono::duration_cast<std::chrono::milliseconds>(here - swept_);
  if (std::abs(now - swept_ms_ - passed.count()) > kStep.count()) {
    spdlog::warn("the clock was set: results of jobs are kept for longer");
    hold_ = here + limits_.kept;
  }
  swept_ = here, swept_ms_ = now;
  if (here < hold_) return;
  const auto old = store_->finished_before(now - limits_.kept.count() * 1000);
  if (!old) return;
  for (const Job& job : *old) forget(job);
}

}  // namespace tind::services
