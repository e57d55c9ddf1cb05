#pragma once
// A piece of long work that a client asked for, as it is kept and as clients see it.

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "terrain/base/enum_names.h"

namespace tind::services {

/// As OGC API - Processes, Part 1, calls them.
enum class JobStatus { accepted, running, successful, failed, dismissed };

}  // namespace tind::services

namespace tind {
template <>
struct EnumNames<services::JobStatus> {
  static constexpr const char* kWhat = "status";
  static constexpr std::pair<services::JobStatus, const char*> kAll[] = {
      {services::JobStatus::accepted, "accepted"},
      {services::JobStatus::running, "running"},
      {services::JobStatus::successful, "successful"},
      {services::JobStatus::failed, "failed"},
      {services::JobStatus::dismissed, "dismissed"}};
};
}  // namespace tind

namespace tind::services {

struct Job {
  static constexpr int kNoRoom = 75;       // an exit code: there was none for its results
  static constexpr int kUnread = 69;       // another: what it was to read cannot be read now
  static constexpr int kMostAttempts = 2;  // it, or the daemon, may be killed once while it runs

  std::string id;       // 32 hexadecimal digits that nobody guesses
  std::string process;  // "simplify"
  std::string client;   // who asked: an address
  /// What is to be done: JobOrder as JSON, of megabytes, perhaps; null in a list. Not for clients.
  std::shared_ptr<const std::string> order;
  JobStatus status = JobStatus::accepted;
  std::string message;      // for a person
  int progress = 0;         // per cent
  int attempts = 0;         // how often it was begun
  int exit_code = 0;        // of failed ones, as the command line ends; 0: it had none
  std::uint64_t bytes = 0;  // of its files
  /// Milliseconds since 1970; 0: not yet.
  std::int64_t created_ms = 0, started_ms = 0, finished_ms = 0, updated_ms = 0;

  bool has_ended() const { return status != JobStatus::accepted && status != JobStatus::running; }
};

/// Milliseconds since 1970.
std::int64_t now_ms();
/// Of a client that waited for its end, and has been told that the daemon stops.
void call_off(Job&);

}  // namespace tind::services
