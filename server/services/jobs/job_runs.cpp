// What becomes of a job from its turn to its end.

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <utility>

#include "proto/base64.h"
#include "server/log/printable.h"
#include "server/services/jobs/job_folders.h"
#include "server/services/jobs/job_messages.h"
#include "server/services/jobs/jobs.h"
#include "terrain/base/caught.h"
#include "terrain/base/errno_text.h"
#include "terrain/base/file_io.h"

namespace tind::services {
namespace {

namespace fs = std::filesystem;

/// Of the command line: where its input does not allow what it was to do. So ends what takes more
/// than jobs may.
constexpr int kTooMuch = 65;
/// Of the command line, too: reading or writing failed on the way.
constexpr int kCannotReadOrWrite = 74;
constexpr std::string_view kWarning = "warning: ";

/// Or what stands beside one, its world file. A name that only begins alike (a folder of jobs) is
/// none.
bool names_source(std::string_view said, const JobOrder& order) {
  return std::ranges::any_of(order.names, [&](const auto& name) {
    const std::string stem = fs::path(name.first).replace_extension().string();
    return !stem.empty() &&
           (said.find(name.first) != said.npos || said.find(stem + ".") != said.npos);
  });
}

Result<void> as_they_were(const std::map<std::string, std::string>& sources) {
  for (const auto& [path, state] : sources)
    if (state_of_source(path) != state)
      return fail(Errc::io, path + ": is another file than when the job was accepted");
  return {};
}

}  // namespace

/// The program's own words.
struct Jobs::Said {
  std::string last;  // of what it has to say beside its warnings
  std::vector<std::string> warnings;
};

/// How far it is, or what it has to say.
void Jobs::hear(Live& live, std::string_view line, Said& said) const {
  if (const auto progress = progress_in(line)) {
    const std::lock_guard lock(mutex_);
    live.job.progress = *progress;
    live.job.message = line;
    live.job.updated_ms = now_ms();
    return;
  }
  constexpr std::string_view kProgram = "tind: ";
  if (line.starts_with(kProgram)) line.remove_prefix(kProgram.size());
  constexpr std::size_t kMostWarnings = 5;
  if (line.starts_with(kWarning)) {
    if (said.warnings.size() < kMostWarnings) said.warnings.emplace_back(line);
    return;
  }
  // Advice for who sits at a command line is none for who has sent a request.
  if (!line.starts_with("Run with --help")) said.last = line;
}

/// Of all that run, as large as they may be, beside what is there; null: there is room.
const char* Jobs::no_room_for_results(const std::string& client) const {
  std::uint64_t running = 0, of_client = 0;
  {
    const std::lock_guard lock(mutex_);
    running = counts_.running;
    for (const auto& [id, live] : live_) of_client += live->running && live->job.client == client;
  }
  // later: who ends meanwhile counts twice, not never
  const auto fits = [&](const Result<std::uint64_t>& stored, std::uint64_t lent, std::uint64_t more,
                        std::uint64_t most) {
    return !stored || *stored + lent + more * limits_.each.file_bytes <= most;
  };
  // Beside others of its client it began because there was room for both.
  if (of_client == 1 &&
      !fits(store_->bytes_of(client), lent_.bytes_of(client), 1, limits_.stored_per_client))
    return kNoRoomForYourResults;
  return fits(store_->total_bytes(), lent_.bytes(), running, limits_.stored_bytes)
             ? nullptr
             : kNoRoomForResults;
}

void Jobs::run(const std::shared_ptr<Live>& live, const std::stop_token& stop) {
  const std::string folder = folder_of(live->job.id);
  if (live->dismissed) return end(live, JobStatus::dismissed, "dismissed");
  const auto failed = [&](const Error& error) {
    spdlog::error("job {}: {}", live->job.id, logging::printable(error.what));
    end(live, JobStatus::failed, "the daemon could not run it; its log says why");
  };
  auto stored = store_->find(live->job.id);
  if (!stored) return failed(stored.error());
  if (*stored) {
    const std::lock_guard lock(mutex_);
    live->job.order = std::move((*stored)->order);
  }
  const JobOrder order = order_of(live->job);
  if (order.waited_for && !live->done)
    return end(live, JobStatus::dismissed, "the daemon ended, and who waited for this is gone");
  if (order.arguments.empty())
    return end(live, JobStatus::failed, "what it was to do cannot be read any more");
  {
    const std::lock_guard lock(mutex_);
    live->job.status = JobStatus::running;
    ++live->job.attempts;
    live->job.started_ms = live->job.updated_ms = now_ms();
  }
  const auto end_with = [&](int exit_code, std::string why) {
    {
      const std::lock_guard lock(mutex_);
      live->job.exit_code = exit_code;
    }
    end(live, JobStatus::failed, std::move(why));
  };
  if (const char* const full = no_room_for_results(live->job.client))  // by those before it
    return end_with(Job::kNoRoom, full);
  const auto changed = [&] {  // of an earlier daemon's nobody else knows
    return live->unchanged ? live->unchanged() : as_they_were(order.sources);
  };
  const auto of_others = [&](const Error& why) {
    spdlog::warn("job {}: {}", live->job.id, logging::printable(why.what));
    end_with(Job::kUnread, "the dataset's files changed while the job waited or ran: ask again");
  };
  if (const auto same = changed(); !same) return of_others(same.error());
  if (auto kept = store_->put(live->job); !kept) return failed(kept.error());
  std::error_code error;
  fs::remove_all(folder, error);
  fs::create_directory(folder, error);
  if (error) return failed({Errc::io, folder + ": " + error.message()});
  for (const auto& [name, content] : order.files)
    if (auto wrote = write_whole_file(folder + "/" + name, content); !wrote)
      return failed(wrote.error());
  for (const auto& [name, text] : order.encoded_files) {
    const auto content = proto::decode_base64(text);
    if (!content) return failed({Errc::bad_data, "the order's file " + name + " is no base64"});
    if (auto wrote = write_whole_file(folder + "/" + name, *content); !wrote)
      return failed(wrote.error());
  }

  std::vector<std::string> words = {program_};
  words.insert(words.end(), order.arguments.begin(), order.arguments.end());
  Said heard;
  const std::stop_callback daemon_stops(stop, [&live] { live->stop.request_stop(); });
  const auto ended = run_child(
      words, folder, limits_.each, [&](std::string_view line) { hear(*live, line, heard); },
      live->stop.get_token());
  if (!ended) return failed(ended.error());
  if (ended->why == ChildEnd::Why::stopped && !live->dismissed) {
    {  // the daemon stops, which is not its fault: the next one begins it again
      const std::lock_guard lock(mutex_);
      --live->job.attempts;
    }
    return put_back(live);
  }
  // What it could not read or write is for whoever looks after the disk: a client can do nothing
  // about it.
  std::string& said = heard.last;
  const int code = ended->why == ChildEnd::Why::exited ? ended->code : 0;
  const bool disk_failed = code == kCannotReadOrWrite;
  const bool is_unread = code == Job::kUnread || (disk_failed && names_source(said, order));
  if (disk_failed || is_unread) spdlog::warn("job {}: {}", live->job.id, logging::printable(said));
  said = for_client(std::move(said), folder, order.names);
  const auto& limits = limits_.each;
  const auto too_much = [&](std::string why) { end_with(kTooMuch, std::move(why)); };
  switch (ended->why) {
    case ChildEnd::Why::stopped:
      return end(live, JobStatus::dismissed, "dismissed");
    case ChildEnd::Why::out_of_time:
      return too_much("it took longer than jobs may, " + std::to_string(limits.wall_time.count()) +
                      " s: ask for a smaller area or a quicker method");
    case ChildEnd::Why::killed:
      spdlog::warn("job {}: ended by signal {}", live->job.id, ended->code);
      if (from_outside(ended->code) && live->job.attempts < Job::kMostAttempts)
        return put_back(live);
      if (ended->code == SIGXFSZ) return too_much(result_too_large(limits.file_bytes));
      if (ended->code == SIGXCPU) return too_much(why_killed(ended->code));
      return end(live, JobStatus::failed, why_killed(ended->code));
    case ChildEnd::Why::exited:
      break;
  }
  if (ended->code == 0) {
    if (const auto same = changed(); !same) return of_others(same.error());  // meanwhile
    std::string done = "done";
    for (const std::string& warning : heard.warnings) done += "; " + warning;
    return end(live, JobStatus::successful, for_client(std::move(done), folder, order.names));
  }
  if (disk_failed && said.find(errno_text(EFBIG)) != said.npos)
    return too_much(result_too_large(limits.file_bytes));
  if (said.starts_with("out of memory") || said.find("std::bad_alloc") != said.npos ||
      said.find(kNoMemory) != said.npos)
    return too_much("it took more memory than jobs may, " +
                    std::to_string(limits.memory_bytes >> 20) + " MB: ask for a smaller area");
  if (disk_failed && said.find(errno_text(ENOSPC)) != said.npos)
    return end_with(Job::kNoRoom, said);
  end_with(is_unread ? Job::kUnread : code, said.empty() ? "it ended without saying why" : said);
}

void Jobs::put_back(const std::shared_ptr<Live>& live) {
  Done done;
  Job job, told;
  {
    const std::lock_guard lock(mutex_);
    live->job.status = JobStatus::accepted;
    live->job.progress = 0;
    live->job.message.clear();
    live->running = false;
    --counts_.running;
    if (stopping_) {
      live_.erase(live->job.id);
      done = std::move(live->done);
    }
    live->job.order = nullptr;  // the list has it
    told = live->job;
    if (done) call_off(live->job);  // nobody asks for it again
    job = live->job;
  }
  if (const auto kept = store_->put(job); !kept)
    spdlog::error("job {}: {}", job.id, logging::printable(kept.error().what));
  if (done) done(told);
  const std::lock_guard lock(mutex_);
  if (!live_.contains(job.id)) return;
  queue_.push_back(job.id);
  ++counts_.waiting;
  wake_.notify_one();
}

void Jobs::end(const std::shared_ptr<Live>& live, JobStatus status, std::string message) {
  const auto order = std::make_shared<const std::string>(order_when_ended(live->job));
  for (;;) {
    std::error_code ignored;
    if (live->dismissed) status = JobStatus::dismissed, message = "dismissed";
    if (status != JobStatus::successful) {
      fs::remove_all(folder_of(live->job.id), ignored);
      lent_.removed(live->job.id);
    }
    std::uint64_t bytes = 0;
    if (status == JobStatus::successful) {  // before it is written down that they are there
      const std::string folder = folder_of(live->job.id);
      const auto kept = sync_results(folder);
      const auto sum = kept ? bytes_in(folder) : std::unexpected(kept.error());
      if (!sum) {
        spdlog::error("job {}: {}", live->job.id, logging::printable(sum.error().what));
        status = JobStatus::failed, message = "its results could not be kept";
        continue;
      }
      bytes = *sum;
    }
    Job ended;
    {
      const std::lock_guard lock(mutex_);
      Job& job = live->job;
      job.order = order;
      job.status = status;
      job.message = message;
      job.finished_ms = job.updated_ms = now_ms();
      job.bytes = bytes;
      if (status == JobStatus::successful) job.progress = 100;
      ended = job;
      unsaved_.erase(job.id);  // what is written down from now on is this
    }
    const auto kept = store_->put(ended);
    if (!kept) spdlog::error("job {}: {}", ended.id, logging::printable(kept.error().what));
    Done done;
    {
      const std::lock_guard lock(mutex_);
      // Somebody who saw its end has dismissed it while that was written down.
      if (live->dismissed && status != JobStatus::dismissed) continue;
      if (!kept) unsaved_[ended.id] = ended;
      if (live->running) --counts_.running;
      stored_bytes_ += bytes;  // at once: what is running no more is stored
      stored_of_[ended.client] += bytes;
      wake_.notify_all();  // there may be room for the results of more
      live_.erase(ended.id);
      ++(status == JobStatus::successful ? counts_.successful
         : status == JobStatus::failed   ? counts_.failed
                                         : counts_.dismissed);
      done = std::move(live->done);
    }
    count_stored();
    count_stored_of(ended.client);
    if (done) done(ended);
    return;
  }
}

}  // namespace tind::services
