#include "server/services/cpu_pool.h"

#include <spdlog/spdlog.h>

#include <exception>

#include "terrain/base/parallel.h"

namespace tind::services {
namespace {

int thread_count(int asked) { return asked > 0 ? asked : hardware_threads(); }

}  // namespace

CpuPool::CpuPool(int threads, std::size_t queue)
    : capacity_(std::size_t(thread_count(threads)) + queue) {
  for (int i = 0; i < thread_count(threads); ++i)
    workers_.emplace_back([this](std::stop_token stop) { work(stop); });
}

Result<CpuPool::Permit> CpuPool::admit() {
  std::size_t count = admitted_.load();
  while (count < capacity_)
    if (admitted_.compare_exchange_weak(count, count + 1)) return Permit(admitted_);
  return fail(Errc::busy, "all workers are busy and the queue is full");
}

void CpuPool::run(Permit permit, Task task) {
  Job job{std::move(permit), std::move(task)};
  {
    const std::lock_guard lock(mutex_);
    if (!stopped_) jobs_.push_back(std::move(job));
  }  // after stop() the job is destroyed here, outside the lock: destructors answer clients
  wake_.notify_one();
}

void CpuPool::work(std::stop_token stop) {
  while (true) {
    std::unique_lock lock(mutex_);
    if (!wake_.wait(lock, stop, [&] { return !jobs_.empty(); })) return;
    Job job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    try {
      job.task(stop);
    } catch (const std::exception& error) {
      spdlog::error("a task failed: {}", error.what());
    }
  }
}

void CpuPool::stop() {
  std::deque<Job> dropped;
  {
    const std::lock_guard lock(mutex_);
    stopped_ = true;
    dropped.swap(jobs_);
  }
  dropped.clear();  // before waiting for the others: those who wait for these are told now
  for (std::jthread& worker : workers_) worker.request_stop();
  for (std::jthread& worker : workers_)
    if (worker.joinable()) worker.join();
}

}  // namespace tind::services
