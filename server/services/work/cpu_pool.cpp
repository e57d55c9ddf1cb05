#include "server/services/work/cpu_pool.h"

#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <exception>

#include "terrain/base/parallel.h"

namespace tind::services {

namespace {

/// In so few several connections of one client would be in each other's way.
constexpr std::size_t kFewPlaces = 16;
constexpr std::size_t kTimesTheRest = 3;  // one client may have so many times what nobody has
constexpr std::size_t kReserve = 8;       // an eighth is for those who have none

/// The calling thread. I/O threads, which need little, come first, so that cached tiles do not wait
/// for cold ones where those keep all cores busy (`scripts/campaign gate --part load`).
void come_after_io() { ::setpriority(PRIO_PROCESS, 0, 5); }  // of Linux: 0 is the thread

}  // namespace

std::string_view name(Work work) {
  switch (work) {
    case Work::question:
      return "question";
    case Work::tile:
      return "tile";
    case Work::batch:
      return "batch";
    case Work::fetch:
      return "fetch";
  }
  return "";
}

CpuPool::CpuPool(int asked, std::size_t queue) {
  // Who asks again as soon as it is answered may come before its old place is free.
  queue = std::max<std::size_t>(queue, 1);
  const auto threads = std::size_t(asked > 0 ? asked : hardware_threads());
  const std::size_t workers = std::max<std::size_t>(threads, 2);
  const auto set = [](Class& c, std::size_t at_a_time, std::size_t waiting) {
    c.at_a_time = at_a_time, c.capacity = at_a_time + waiting;
  };
  set(class_of(Work::question), workers, queue);
  set(class_of(Work::tile), threads, queue);
  set(class_of(Work::batch), std::max<std::size_t>(threads / 2, 1), (queue + 7) / 8);
  set(class_of(Work::fetch), kFetches, queue);
  for (std::size_t i = 0; i < workers + kFetches; ++i)
    workers_.emplace_back(
        [this, fetches = i >= workers](const std::stop_token& stop) { work(stop, fetches); });
}

/// Under the mutex, as all of a class.
bool CpuPool::Class::take_place(const std::string& client) {
  if (admitted.load() >= capacity) return false;
  if (!client.empty()) {
    const auto found = clients.find(client);
    const std::size_t mine = 1 + (found == clients.end() ? 0 : found->second);
    const std::size_t rest = capacity - admitted.load() - 1;
    if (capacity >= kFewPlaces && mine > 1 &&
        (mine > kTimesTheRest * rest || rest < capacity / kReserve))
      return false;
    clients[client] = mine;
  }
  admitted.fetch_add(1);
  return true;
}

void CpuPool::Class::queue(JobList& one) {
  const std::string& client = one.front().permit.client_;
  const auto mine = std::ranges::find(waiting, client, &Line::client);
  Line& line = mine != waiting.end() ? *mine : waiting.emplace_back(client);
  line.jobs.splice(line.jobs.end(), one);
}

CpuPool::JobList CpuPool::Class::next() {
  JobList one, &jobs = waiting.front().jobs;
  one.splice(one.end(), jobs, jobs.begin());
  if (jobs.empty())
    waiting.pop_front();
  else
    waiting.splice(waiting.end(), waiting, waiting.begin());
  return one;
}

Result<CpuPool::Permit> CpuPool::admit(Work work, std::string client) {
  Class& c = class_of(work);
  const auto try_once = [&] {
    const std::lock_guard lock(mutex_);
    return c.take_place(client);
  };
  if (try_once()) return Permit(*this, work, std::move(client));
  drop_abandoned(c);
  if (try_once()) return Permit(*this, work, std::move(client));
  c.refused.fetch_add(1);
  return fail(Errc::busy, "all workers for this are busy and the queue is full");
}

void CpuPool::give_back(Work work, const std::string& client) {
  Class& c = class_of(work);
  const std::lock_guard lock(mutex_);
  c.admitted.fetch_sub(1);
  const auto mine = c.clients.find(client);
  if (mine != c.clients.end() && --mine->second == 0) c.clients.erase(mine);
}

/// The dead must not keep the living out.
void CpuPool::drop_abandoned(Class& c) {
  JobList dead;  // destroyed outside the lock: destructors answer clients
  const std::lock_guard lock(mutex_);
  for (Line& line : c.waiting)
    for (auto job = line.jobs.begin(); job != line.jobs.end();) {
      const auto here = job++;
      if (here->gone.stop_requested()) dead.splice(dead.end(), line.jobs, here);
    }
  std::erase_if(c.waiting, [](const Line& line) { return line.jobs.empty(); });
  c.abandoned.fetch_add(dead.size());
}

void CpuPool::run(Permit permit, Task task, std::stop_token gone) {
  Class& c = class_of(permit.work_);
  const bool fetch = permit.work_ == Work::fetch;
  JobList job;
  job.push_back({std::move(permit), std::move(task), std::move(gone)});
  {
    const std::lock_guard lock(mutex_);
    if (!stopped_) c.queue(job);
  }  // after stop() the job is destroyed here, outside the lock: destructors answer clients
  (fetch ? wake_fetchers_ : wake_).notify_one();
}

/// The first class, from the one whose turn it is, that has a job and may run one more. Null: none.
CpuPool::Class* CpuPool::next_class(bool fetches) {
  Class& fetch = class_of(Work::fetch);
  if (fetches) return fetch.waiting.empty() ? nullptr : &fetch;
  for (std::size_t k = 0; k < classes_.size(); ++k) {
    Class& c = classes_[(turn_ + k) % classes_.size()];
    if (&c == &fetch || c.waiting.empty() || c.running >= c.at_a_time) continue;
    turn_ = (turn_ + k + 1) % classes_.size();
    return &c;
  }
  return nullptr;
}

void CpuPool::work(const std::stop_token& stop, bool fetches) {
  if (!fetches) come_after_io();
  auto& wake = fetches ? wake_fetchers_ : wake_;
  while (true) {
    std::unique_lock lock(mutex_);
    Class* c = nullptr;
    if (!wake.wait(lock, stop, [&] { return (c = next_class(fetches)) != nullptr; })) return;
    JobList job = c->next();
    ++c->running;
    lock.unlock();
    do_job(job.front(), *c, stop);
    job.clear();  // gives its place back
    lock.lock();
    --c->running;  // this worker looks again: nobody needs to be woken
  }
}

void CpuPool::do_job(Job& job, Class& c, const std::stop_token& stop) {
  if (!job.gone.stop_requested()) {
    std::stop_source either;
    const auto end = [&either] { either.request_stop(); };
    const std::stop_callback by_us(stop, end), by_them(job.gone, end);
    try {
      job.task(either.get_token());
    } catch (const std::exception& error) {
      spdlog::error("a task failed: {}", error.what());
    }
  }
  if (job.gone.stop_requested()) c.abandoned.fetch_add(1);
}

std::size_t CpuPool::admitted() const {
  std::size_t sum = 0;
  for (const Class& c : classes_) sum += c.admitted.load();
  return sum;
}

void CpuPool::stop() {
  std::vector<std::list<Line>> dropped;
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    for (Class& c : classes_) dropped.push_back(std::exchange(c.waiting, {}));
  }
  dropped.clear();  // before waiting for the others: those who wait for these are told now
  for (std::jthread& worker : workers_) worker.request_stop();
  for (std::jthread& worker : workers_)
    if (worker.joinable()) worker.join();
}

}  // namespace tind::services
