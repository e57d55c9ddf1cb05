#include "server/services/jobs/job.h"

#include <chrono>

namespace tind::services {

std::int64_t now_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

void call_off(Job& job) {
  job.status = JobStatus::dismissed;
  job.message = "dismissed";
  job.finished_ms = job.updated_ms = now_ms();
  job.order = std::make_shared<const std::string>("{}");  // of megabytes, and of no use any more
}

}  // namespace tind::services
