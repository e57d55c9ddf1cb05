#pragma once
// Jobs of a shell, in a folder for tests.

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <future>
#include <memory>
#include <string>
#include <thread>

#include "server/services/jobs/jobs.h"
#include "tests/support/support.h"

namespace tind::services {

/// Orders of a shell, which stands for the program.
inline JobOrder shell(const std::string& script, const std::string& client = "1.2.3.4") {
  JobOrder order;
  order.process = "test", order.client = client;
  order.arguments = {"-c", script};
  order.outputs = {{"out", "out.txt", "text/plain"}};
  return order;
}

class JobsTest : public testing::Test {
 protected:
  std::unique_ptr<Jobs> open(JobLimits limits = {}) {
    auto jobs = Jobs::open(dir_.file("jobs"), "/bin/sh", limits);
    EXPECT_TRUE(jobs) << jobs.error().what;
    return std::move(*jobs);
  }
  /// Done, and how.
  static Job run(Jobs& jobs, const JobOrder& order) {
    std::promise<Job> ended;
    const auto job = jobs.submit(order, [&](const Job& j) { ended.set_value(j); });
    EXPECT_TRUE(job) << job.error().what;
    return ended.get_future().get();
  }
  /// Until a job is as it is wanted.
  template <class Wanted>
  static bool becomes(Jobs& jobs, const std::string& id, Wanted wanted) {
    for (int i = 0; i < 2000; ++i) {
      const auto job = jobs.find(id);
      if (job && *job && wanted(**job)) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return false;
  }
  static std::string content(const std::string& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  std::string folder(const Job& job) const { return dir_.file("jobs/" + job.id); }

  test::TempDir dir_;
};

}  // namespace tind::services
