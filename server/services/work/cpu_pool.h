#pragma once
// Where work happens: a fixed number of threads behind bounded queues, one for each class of work.
// What does not fit is refused at once, so that a flood of cold tiles costs the clients a 503 and
// never the server its memory. Workers take from the classes in turn, and a long class may never
// hold all of them: a plan or the preparing of a scene keeps no tile waiting, and tiles no
// question. Within a class clients take turns, and none may have all of its places: who asks for
// one tile does not wait for all that somebody else asked for. Work whose client has gone is not
// begun, and what has begun is told.

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "terrain/base/result.h"

namespace tind::services {

enum class Work : std::uint8_t {
  question,  // microseconds to milliseconds: a height, the beginning of a stream, a known view
  tile,      // milliseconds to a second: a tile, or what is made of one
  batch,     // seconds: flight plans, many tiles, preparing a scene
  fetch      // an answer of another machine is waited for: a tile in object storage
};
inline constexpr std::array kWorks = {Work::question, Work::tile, Work::batch, Work::fetch};
std::string_view name(Work);

class CpuPool {
 public:
  using Task = std::move_only_function<void(std::stop_token)>;

  /// The right to one place in a class, waiting or running; given back by its destructor, which
  /// the pool must outlive.
  class Permit {
   public:
    Permit(Permit&& other) noexcept
        : pool_(std::exchange(other.pool_, nullptr)),
          work_(other.work_),
          client_(std::move(other.client_)) {}
    Permit& operator=(Permit&&) = delete;
    ~Permit() {
      if (pool_) pool_->give_back(work_, client_);
    }

   private:
    friend class CpuPool;
    Permit(CpuPool& pool, Work work, std::string client)
        : pool_(&pool), work_(work), client_(std::move(client)) {}
    CpuPool* pool_;
    Work work_;
    std::string client_;
  };

  static constexpr std::size_t kFetches = 16;

  /// `threads` 0: one per core. At a time they do that many tiles, and half as many batches; with
  /// one there is a second thread, so that a batch is not in the way. `queue`: tasks of a class
  /// that may wait beside those that run, at least one; of batches, which keep more, an eighth of
  /// that.
  /// Who fetches waits more than it works: kFetches threads beside the others do nothing else.
  CpuPool(int threads, std::size_t queue);
  ~CpuPool() { stop(); }
  CpuPool(const CpuPool&) = delete;
  CpuPool& operator=(const CpuPool&) = delete;

  /// Errc::busy when the class has all the work that it may have, or this client has some and
  /// would have more than three times those that are left (one alone gets three quarters), or the
  /// last eighth is reached, which is for those who have none. All of fewer than 16 places may be
  /// of one, and of any of nobody in particular (empty). Cheap: for I/O threads.
  Result<Permit> admit(Work, std::string client = {});
  /// Runs the task on a worker; its token is stopped by stop(), and by `gone`: whoever wanted it
  /// does not any more. One that never runs, because of either, is destroyed.
  void run(Permit, Task, std::stop_token gone = {});

  /// Tells running tasks to stop, drops those that wait, joins. Idempotent.
  void stop();

  /// Tasks admitted: waiting or running.
  std::size_t admitted(Work work) const { return class_of(work).admitted.load(); }
  std::size_t admitted() const;
  std::size_t capacity(Work work) const { return class_of(work).capacity; }
  std::uint64_t refused(Work work) const { return class_of(work).refused.load(); }
  /// Tasks that were told to stop, or never begun, because nobody wanted them any more.
  std::uint64_t abandoned(Work work) const { return class_of(work).abandoned.load(); }

 private:
  struct Job {
    Permit permit;
    Task task;
    std::stop_token gone;
  };
  /// Lists: under the mutex jobs only go from one to another, which takes no memory. One that an
  /// exception destroyed there would wait for the mutex to give its place back.
  using JobList = std::list<Job>;
  /// What one client waits for.
  struct Line {
    std::string client;
    JobList jobs;
  };
  struct Class {
    std::atomic<std::size_t> admitted{0};
    std::atomic<std::uint64_t> refused{0}, abandoned{0};
    std::size_t capacity = 0;   // may wait or run
    std::size_t at_a_time = 0;  // may run
    // Under the mutex:
    std::size_t running = 0;
    std::map<std::string, std::size_t, std::less<>> clients;  // their places
    std::list<Line> waiting;                                  // none empty; the first has its turn

    bool take_place(const std::string& client);
    void queue(JobList& one);
    JobList next();
  };
  Class& class_of(Work work) { return classes_[std::size_t(work)]; }
  const Class& class_of(Work work) const { return classes_[std::size_t(work)]; }

  void work(const std::stop_token&, bool fetches);
  Class* next_class(bool fetches);
  void do_job(Job&, Class&, const std::stop_token&);
  void drop_abandoned(Class&);
  void give_back(Work, const std::string& client);

  std::mutex mutex_;
  std::condition_variable_any wake_, wake_fetchers_;
  std::array<Class, kWorks.size()> classes_;
  std::size_t turn_ = 0;  // whose it is to give the next job
  bool stopped_ = false;
  std::vector<std::jthread> workers_;
};

}  // namespace tind::services
