#pragma once
// Where work happens: a fixed number of threads behind a bounded queue. What does not fit is
// refused at once, so that a flood of cold tiles costs the clients a 503 and never the server its
// memory.

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "terrain/base/result.h"

namespace tind::services {

class CpuPool {
 public:
  using Task = std::move_only_function<void(std::stop_token)>;

  /// The right to one place in the pool, waiting or running; given back by its destructor.
  class Permit {
   public:
    Permit(Permit&& other) noexcept : count_(std::exchange(other.count_, nullptr)) {}
    Permit& operator=(Permit&&) = delete;
    ~Permit() {
      if (count_) count_->fetch_sub(1);
    }

   private:
    friend class CpuPool;
    explicit Permit(std::atomic<std::size_t>& count) : count_(&count) {}
    std::atomic<std::size_t>* count_;
  };

  /// `threads` 0: one per core. `queue`: tasks that may wait beside those that run.
  CpuPool(int threads, std::size_t queue);
  ~CpuPool() { stop(); }
  CpuPool(const CpuPool&) = delete;
  CpuPool& operator=(const CpuPool&) = delete;

  /// Errc::busy when every thread has work and the queue is full. Lock-free.
  Result<Permit> admit();
  /// Runs the task on a worker. One that never runs, because of stop(), is destroyed.
  void run(Permit, Task);

  /// Tells running tasks to stop, drops those that wait, joins. Idempotent.
  void stop();

  /// Tasks admitted: waiting or running.
  std::size_t admitted() const { return admitted_.load(std::memory_order_relaxed); }
  std::size_t capacity() const { return capacity_; }

 private:
  struct Job {
    Permit permit;
    Task task;
  };
  void work(std::stop_token);

  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<Job> jobs_;
  bool stopped_ = false;
  std::atomic<std::size_t> admitted_{0};
  const std::size_t capacity_;  // threads + queue
  std::vector<std::jthread> workers_;
};

}  // namespace tind::services
