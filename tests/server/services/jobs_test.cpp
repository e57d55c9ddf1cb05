#include "server/services/jobs/jobs.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <future>
#include <thread>
#include <vector>

#include "tests/server/services/jobs_fixture.h"

namespace tind::services {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

TEST_F(JobsTest, ResultsAreWhatTheProgramWritesInItsFolder) {
  const auto jobs = open();
  JobOrder order = shell("cat given.txt bytes > out.txt; echo words that nobody hears");
  order.files["given.txt"] = "from a ";
  order.encoded_files["bytes"] = "Y2xpZW50";  // "client"
  const Job job = run(*jobs, order);
  EXPECT_EQ(job.status, JobStatus::successful) << job.message;
  EXPECT_EQ(job.progress, 100);
  EXPECT_EQ(content(jobs->path_of(job, order.outputs[0])), "from a client");
  EXPECT_EQ(job.bytes, 2 * std::string("from a client").size());
  const auto found = jobs->find(job.id);
  ASSERT_TRUE(found && *found);
  EXPECT_EQ((*found)->status, JobStatus::successful);
  const JobOrder kept = order_of(**found);
  EXPECT_EQ(kept.outputs[0].media_type, "text/plain");
  EXPECT_TRUE(kept.files.empty() && kept.encoded_files.empty()) << "what was given is done with";
}

TEST_F(JobsTest, SaysHowFarItIsAndWhyItFailed) {
  const auto jobs = open();
  const auto job = jobs->submit(
      shell("echo 'bounded: 40 %, 5 s left' >&2; sleep 0.5; echo 'tind: /secret/a.tif: no' >&2; "
            "exit 65"));
  ASSERT_TRUE(job);
  EXPECT_TRUE(becomes(*jobs, job->id, [](const Job& j) { return j.progress == 40; }));
  ASSERT_TRUE(becomes(*jobs, job->id, [](const Job& j) { return j.has_ended(); }));
  const Job ended = **jobs->find(job->id);
  EXPECT_EQ(ended.status, JobStatus::failed);
  EXPECT_EQ(ended.exit_code, 65);
  EXPECT_EQ(ended.message, "...: no");
  EXPECT_FALSE(fs::exists(folder(ended)));

  EXPECT_EQ(
      run(*jobs, shell("echo '--x: no' >&2; echo 'Run with --help for more.' >&2; exit 2")).message,
      "--x: no");
  JobOrder order = shell("echo 'tind: /secret/a.tif: no' >&2; exit 65");
  order.names = {{"/secret/a.tif", "alps"}};
  EXPECT_EQ(run(*jobs, order).message, "alps: no");
}

TEST_F(JobsTest, WhatTheProgramWarnsOfIsSaidOfItsResult) {
  const auto jobs = open();
  JobOrder order = shell(
      "echo 'tind: warning: /secret/a.tif: its datum is unknown' >&2; echo 'tind: words' >&2; "
      "echo 'tind: warning: lengths are stretched' >&2; echo > out.txt");
  order.names = {{"/secret/a.tif", "alps"}};
  EXPECT_EQ(run(*jobs, order).message,
            "done; warning: alps: its datum is unknown; warning: lengths are stretched");
}

/// It holds the pipe through which the program speaks, and would for half an hour.
TEST_F(JobsTest, WhatAProgramLeavesBehindIsNotWaitedFor) {
  const auto jobs = open();
  const auto job = jobs->submit(shell("sleep 1800 & echo 'tind: the last word' >&2; exit 65"));
  ASSERT_TRUE(job);
  ASSERT_TRUE(becomes(*jobs, job->id, [](const Job& j) { return j.has_ended(); }));
  EXPECT_EQ((**jobs->find(job->id)).message, "the last word");
}

volatile std::sig_atomic_t in_the_way = 0;

/// Libraries ask for something to be done in a child that forks off. PROJ waits for a mutex there,
/// which another thread of the daemon may have held: the child never became the program.
TEST_F(JobsTest, WhatLibrariesDoInAForkedChildIsNotDone) {
  ASSERT_EQ(::pthread_atfork(nullptr, nullptr,
                             [] {
                               if (in_the_way) ::_exit(70);
                             }),
            0);
  const auto jobs = open();
  in_the_way = 1;
  const Job job = run(*jobs, shell("echo words > out.txt"));
  in_the_way = 0;
  EXPECT_EQ(job.status, JobStatus::successful) << job.message;
}

TEST_F(JobsTest, LimitsAreHeld) {
  JobLimits limits;
  limits.each = {.memory_bytes = 512u << 20, .file_bytes = 1u << 20, .cpu_time = 1s, .niceness = 0};
  auto jobs = open(limits);
  const Job large = run(*jobs, shell("exec head -c 3000000 /dev/zero > out.txt"));
  EXPECT_EQ(large.status, JobStatus::failed);
  EXPECT_FALSE(fs::exists(folder(large)));
  EXPECT_NE(large.message.find("than those of jobs may be, 1 MB"), std::string::npos)
      << large.message;
  const Job full = run(*jobs, shell("echo 'tind: out of memory: run it again' >&2; exit 75"));
  EXPECT_NE(full.message.find("more memory than jobs may, 512 MB"), std::string::npos);
  EXPECT_EQ(full.exit_code, 65) << "the same request would end like that again";
  const Job hungry = run(*jobs, shell("echo 'tind: internal error: std::bad_alloc' >&2; exit 1"));
  EXPECT_NE(hungry.message.find("more memory than jobs may, 512 MB"), std::string::npos);
  EXPECT_EQ(hungry.exit_code, 65);
  const Job busy = run(*jobs, shell("while :; do :; done"));
  EXPECT_EQ(busy.status, JobStatus::failed);
  EXPECT_NE(busy.message.find("CPU time"), std::string::npos) << busy.message;
  EXPECT_EQ(busy.exit_code, 65) << "as what its input does not allow";
  EXPECT_EQ(run(*jobs, shell("echo a > out.txt")).status, JobStatus::successful);
  jobs.reset();
  limits.each.wall_time = 1s;
  jobs = open(limits);
  const Job slow = run(*jobs, shell("sleep 60"));
  EXPECT_EQ(slow.status, JobStatus::failed);
  EXPECT_NE(slow.message.find("longer"), std::string::npos) << slow.message;
  EXPECT_EQ(slow.exit_code, 65);
}

TEST_F(JobsTest, WhereTheirFolderHasGoneNoneIsTaken) {
  const auto jobs = open();
  EXPECT_EQ(jobs->unwritable(), 0);
  fs::rename(dir_.file("jobs"), dir_.file("away"));
  const auto refused = jobs->submit(shell("echo a > out.txt"));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::io);
  EXPECT_EQ(jobs->unwritable(), ENOENT);
  fs::rename(dir_.file("away"), dir_.file("jobs"));
  EXPECT_EQ(run(*jobs, shell("echo a > out.txt")).status, JobStatus::successful);
  EXPECT_EQ(jobs->unwritable(), 0);
}

TEST_F(JobsTest, WhereTheirListIsAnotherNoneIsTaken) {
  const auto jobs = open();
  const std::string list = dir_.file("jobs/jobs.sqlite");
  const auto expect_refused = [&](int because) {
    const auto refused = jobs->submit(shell("echo a > out.txt"));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, Errc::io);
    EXPECT_EQ(jobs->unwritable(), because);
  };
  fs::rename(dir_.file("jobs"), dir_.file("away"));
  fs::create_directory(dir_.file("jobs"));  // and no restart would find what is put in the old one
  expect_refused(Jobs::kOtherList);
  std::ofstream(list) << "";
  expect_refused(Jobs::kOtherList);
  fs::remove(list);
  fs::create_symlink("jobs.sqlite", list);  // which nobody can look at
  expect_refused(ELOOP);
  fs::remove_all(dir_.file("jobs"));
  fs::rename(dir_.file("away"), dir_.file("jobs"));
  EXPECT_EQ(run(*jobs, shell("echo a > out.txt")).status, JobStatus::successful);
  EXPECT_EQ(jobs->unwritable(), 0);
}

TEST_F(JobsTest, WhatCannotBeReadIsToldFromWhatCannotBeWritten) {
  const auto jobs = open();
  const auto exit_code = [&](const std::string& script) {
    JobOrder order = shell(script);
    order.names = {{"/secret/a.tif", "alps"}};
    const Job job = run(*jobs, order);
    EXPECT_EQ(job.status, JobStatus::failed);
    return job.exit_code;
  };
  EXPECT_EQ(exit_code("echo 'tind: /secret/a.tif: no' >&2; exit 69"), Job::kUnread);
  EXPECT_EQ(exit_code("echo 'tind: /secret/a.tif: its pixels: no' >&2; exit 74"), Job::kUnread);
  EXPECT_EQ(exit_code("echo 'tind: /secret/a.tfw: no' >&2; exit 74"), Job::kUnread);
  EXPECT_EQ(exit_code("echo 'tind: out.txt: the disk is full' >&2; exit 74"), 74);
}

TEST_F(JobsTest, WhatIsDismissedStopsAndLeavesNothing) {
  const auto jobs = open();
  const auto running = jobs->submit(shell("echo $$ > pid; trap '' TERM; sleep 60; sleep 60"));
  const auto waiting = jobs->submit(shell("echo never > out.txt"));
  ASSERT_TRUE(running && waiting);
  ASSERT_TRUE(becomes(*jobs, running->id, [&](const Job& j) {
    return j.status == JobStatus::running && content(folder(j) + "/pid").ends_with("\n");
  }));
  const pid_t child = std::stoi(content(folder(*running) + "/pid"));
  EXPECT_EQ((*jobs->dismiss(waiting->id))->status, JobStatus::dismissed);
  EXPECT_EQ((*jobs->dismiss(running->id))->status, JobStatus::dismissed);
  EXPECT_EQ((*jobs->find(running->id))->status, JobStatus::dismissed) << "at once, for who asks";
  EXPECT_TRUE(becomes(*jobs, running->id, [&](const Job& j) {  // although it would not listen
    return ::kill(child, 0) == -1 && !fs::exists(folder(j));
  }));
  EXPECT_EQ((*jobs->find(running->id))->status, JobStatus::dismissed);
  EXPECT_FALSE(fs::exists(folder(*waiting)));
  EXPECT_FALSE(*jobs->dismiss("ffffffffffffffffffffffffffffffff"));
  const Job done = run(*jobs, shell("echo a > out.txt"));
  EXPECT_EQ((*jobs->dismiss(done.id))->status, JobStatus::dismissed);
  EXPECT_FALSE(fs::exists(folder(done)));
}

TEST_F(JobsTest, WhoSeesTheEndMayDismissAtOnce) {
  const auto jobs = open();
  for (int i = 0; i < 30; ++i) {  // most of these come while the end is being written down
    const auto job = jobs->submit(shell("echo a > out.txt"));
    ASSERT_TRUE(job);
    while (!(**jobs->find(job->id)).has_ended()) std::this_thread::yield();
    ASSERT_TRUE(*jobs->dismiss(job->id));
    EXPECT_TRUE(
        becomes(*jobs, job->id, [](const Job& j) { return j.status == JobStatus::dismissed; }));
    EXPECT_TRUE(becomes(*jobs, job->id, [&](const Job& j) { return !fs::exists(folder(j)); }));
  }
}

TEST_F(JobsTest, WhoeverHangsUpWantsItNoMore) {
  const auto jobs = open();
  std::stop_source gone;
  std::promise<Job> ended;
  const auto job = jobs->submit(
      shell("sleep 60"), [&](const Job& j) { ended.set_value(j); }, gone.get_token());
  ASSERT_TRUE(job);
  gone.request_stop();
  EXPECT_EQ(ended.get_future().get().status, JobStatus::dismissed);
}

TEST_F(JobsTest, RoomIsBounded) {
  JobLimits limits;
  limits.waiting = 2, limits.per_client = 2;
  const auto jobs = open(limits);
  const auto first = jobs->submit(shell("sleep 60", "a"));
  ASSERT_TRUE(first);
  ASSERT_TRUE(
      becomes(*jobs, first->id, [](const Job& j) { return j.status == JobStatus::running; }));
  ASSERT_TRUE(jobs->submit(shell("sleep 60", "a")));
  const auto third = jobs->submit(shell("sleep 60", "a"));
  ASSERT_FALSE(third);
  EXPECT_EQ(third.error().code, Errc::busy);
  EXPECT_NE(third.error().what.find("you have 2 jobs"), std::string::npos) << third.error().what;
  ASSERT_TRUE(jobs->submit(shell("sleep 60", "b")));
  const auto fourth = jobs->submit(shell("sleep 60", "c"));
  ASSERT_FALSE(fourth);
  EXPECT_NE(fourth.error().what.find("2 jobs wait"), std::string::npos) << fourth.error().what;
}

TEST_F(JobsTest, ClientsTakeTurns) {
  const auto jobs = open();  // one at a time
  const std::string log = dir_.file("order");
  const auto submit = [&](const std::string& client) {
    return jobs->submit(shell("echo " + client + " >> '" + log + "'", client));
  };
  const auto first =
      jobs->submit(shell("while [ ! -e '" + dir_.file("go") + "' ]; do sleep .01; done"));
  ASSERT_TRUE(first);
  ASSERT_TRUE(
      becomes(*jobs, first->id, [](const Job& j) { return j.status == JobStatus::running; }));
  std::string last;
  for (const char* client : {"a", "a", "a", "b", "b", "c"}) {
    const auto job = submit(client);
    ASSERT_TRUE(job);
    if (std::string_view(client) == "a") last = job->id;
  }
  std::ofstream(dir_.file("go")) << "";
  ASSERT_TRUE(becomes(*jobs, last, [](const Job& j) { return j.has_ended(); }));
  EXPECT_EQ(content(log), "a\nb\nc\na\nb\na\n");
}

TEST_F(JobsTest, WhoComesAgainWhileItsJobRunsComesBehindTheOthers) {
  const auto jobs = open();
  const std::string log = dir_.file("order");
  const auto submit = [&](const std::string& client, const std::string& until) {
    const auto job = jobs->submit(shell(
        "echo " + client + " >> '" + log + "'; while [ ! -e '" + until + "' ]; do sleep .01; done",
        client));
    EXPECT_TRUE(job);
    return job->id;
  };
  const auto runs = [&](const std::string& id) {
    return becomes(*jobs, id, [](const Job& j) { return j.status == JobStatus::running; });
  };
  const std::string first = dir_.file("first"), second = dir_.file("second");
  const std::string b = submit("b", first);
  ASSERT_TRUE(runs(b));
  submit("b", log);  // which is there: no wait
  const std::string a = submit("a", second);
  std::ofstream(first) << "";
  ASSERT_TRUE(runs(a));
  const std::string last = submit("a", log);
  std::ofstream(second) << "";
  ASSERT_TRUE(becomes(*jobs, last, [](const Job& j) { return j.has_ended(); }));
  EXPECT_EQ(content(log), "b\na\nb\na\n");
}

TEST_F(JobsTest, WhoHangsUpGivesItsPlaceAtOnce) {
  JobLimits limits;
  limits.per_client = 2;
  const auto jobs = open(limits);
  const auto first = jobs->submit(shell("sleep 60"));
  ASSERT_TRUE(first);
  ASSERT_TRUE(
      becomes(*jobs, first->id, [](const Job& j) { return j.status == JobStatus::running; }));
  std::stop_source gone;
  std::promise<Job> ended;
  ASSERT_TRUE(jobs->submit(
      shell("true"), [&](const Job& j) { ended.set_value(j); }, gone.get_token()));
  EXPECT_FALSE(jobs->submit(shell("true")));
  gone.request_stop();
  EXPECT_TRUE(jobs->submit(shell("true")));
  EXPECT_EQ(ended.get_future().get().status, JobStatus::dismissed);
  EXPECT_EQ(jobs->counts().waiting, 1u);
}

TEST_F(JobsTest, AStopAnswersThoseThatWait) {
  const auto jobs = open();
  std::promise<Job> runs, waits;
  ASSERT_TRUE(jobs->submit(shell("sleep 60"), [&](const Job& j) { runs.set_value(j); }));
  ASSERT_TRUE(jobs->submit(shell("true"), [&](const Job& j) { waits.set_value(j); }));
  jobs->stop();
  for (std::promise<Job>* told : {&runs, &waits}) {
    auto job = told->get_future();
    ASSERT_EQ(job.wait_for(0s), std::future_status::ready);
    EXPECT_EQ(job.get().status, JobStatus::accepted);
  }
  EXPECT_FALSE(jobs->submit(shell("true")));
}

TEST_F(JobsTest, WhoWasToldThatTheDaemonStopsHasNothingRunLater) {
  std::vector<std::string> ids;
  {
    const auto jobs = open();
    for (const char* const script : {"sleep 60", "true"})  // one runs, one waits
      ids.push_back(jobs->submit(shell(script), [](const Job&) {})->id);
    ASSERT_TRUE(
        becomes(*jobs, ids[0], [](const Job& j) { return j.status == JobStatus::running; }));
  }
  const auto jobs = open();
  EXPECT_EQ(jobs->counts().waiting + jobs->counts().running, 0u);
  for (const std::string& id : ids) EXPECT_EQ((*jobs->find(id))->status, JobStatus::dismissed);
}

TEST_F(JobsTest, WhatItReadsMustBeAsItWasWhenItWasAskedFor) {
  const auto jobs = open();
  std::atomic<int> asked = 0;
  const auto changes_at = [&](int time) {
    asked = 0;
    std::promise<Job> ended;
    EXPECT_TRUE(jobs->submit(
        shell("echo a > out.txt"), [&](const Job& j) { ended.set_value(j); }, {},
        [&asked, time]() -> Result<void> {
          if (++asked == time) return fail(Errc::io, "another file");
          return {};
        }));
    return ended.get_future().get();
  };
  for (const int time : {1, 2}) {  // before it runs, and while it does
    const Job job = changes_at(time);
    EXPECT_EQ(job.status, JobStatus::failed);
    EXPECT_NE(job.message.find("ask again"), std::string::npos) << job.message;
    EXPECT_EQ(job.exit_code, Job::kUnread);
    EXPECT_FALSE(fs::exists(folder(job)));
  }
  EXPECT_EQ(changes_at(3).status, JobStatus::successful);
}

TEST_F(JobsTest, ThoseWhoseResultsHaveNoRoomYetWaitForThoseThatRun) {
  JobLimits limits;
  limits.running = 4;
  limits.stored_bytes = 25000, limits.each.file_bytes = 10000;  // of two at a time
  const auto jobs = open(limits);
  std::vector<std::promise<Job>> ends(6);
  for (auto& end : ends)
    ASSERT_TRUE(jobs->submit(shell("sleep 0.2"), [&end](const Job& job) { end.set_value(job); }));
  std::size_t most = 0;
  for (auto& end : ends) {
    auto future = end.get_future();
    while (future.wait_for(10ms) != std::future_status::ready)
      most = std::max(most, jobs->counts().running);
    EXPECT_EQ(future.get().status, JobStatus::successful);
  }
  EXPECT_LE(most, 2u);
}

TEST_F(JobsTest, ResultsThatFillTheStoreLetNoMoreIn) {
  JobLimits limits;
  limits.stored_bytes = 31000, limits.each.file_bytes = 10000;
  const auto jobs = open(limits);
  Job last;
  for (int i = 0; i < 3; ++i) last = run(*jobs, shell("head -c 9000 /dev/zero > out.txt"));
  const auto more = jobs->submit(shell("echo a > out.txt"));
  ASSERT_FALSE(more);
  EXPECT_NE(more.error().what.find("results of earlier jobs"), std::string::npos);
  ASSERT_TRUE(jobs->dismiss(last.id));
  EXPECT_TRUE(jobs->submit(shell("echo a > out.txt")));
}

TEST_F(JobsTest, OneResultMayTakeAllThatThereIs) {
  JobLimits limits;
  limits.stored_bytes = limits.stored_per_client = limits.each.file_bytes = 10000;
  const auto jobs = open(limits);
  for (int i = 0; i < 2; ++i) {
    const Job job = run(*jobs, shell("head -c 9000 /dev/zero > out.txt"));
    EXPECT_EQ(job.status, JobStatus::successful) << job.message;
    jobs->forget(job);
  }
}

/// Files that have no name any more take their place until nobody has them open.
TEST_F(JobsTest, ResultsThatAreBeingSentCountWhoeverRemovesThem) {
  JobLimits limits;
  limits.stored_bytes = 31000, limits.each.file_bytes = 10000;
  const auto jobs = open(limits);
  std::vector<LentResults::Loan> loans;
  for (int i = 0; i < 3; ++i) {
    const Job job = run(*jobs, shell("head -c 9000 /dev/zero > out.txt"));
    loans.push_back(jobs->lend(job));
    loans.push_back(jobs->lend(job));
    if (i == 0)
      ASSERT_TRUE(jobs->dismiss(job.id));
    else
      jobs->forget(job);
  }
  EXPECT_FALSE(jobs->submit(shell("echo a > out.txt")));
  loans.pop_back();
  EXPECT_FALSE(jobs->submit(shell("echo a > out.txt"))) << "somebody has it still";
  loans.pop_back();
  EXPECT_EQ(run(*jobs, shell("echo a > out.txt")).status, JobStatus::successful);
}

TEST_F(JobsTest, WhatThoseThatWaitWereGivenIsBoundedAndCounts) {
  JobLimits limits;
  limits.per_client = 100;
  const auto jobs = open(limits);
  ASSERT_TRUE(jobs->submit(shell("sleep 60")));
  JobOrder order = shell("wc -c < mesh.txt > out.txt");
  order.files["mesh.txt"] = std::string(15u << 20, 'x');
  std::string last;
  int taken = 0;
  for (; taken < 10; ++taken) {
    const auto job = jobs->submit(order);
    if (!job) {
      EXPECT_EQ(job.error().code, Errc::busy);
      break;
    }
    EXPECT_EQ(job->order, nullptr) << "it is kept on disk alone";
    last = job->id;
  }
  EXPECT_EQ(taken, 4);  // of 64 MB
  EXPECT_TRUE(jobs->submit(shell("true"))) << "a small one";
  order.client = "somebody else";
  EXPECT_TRUE(jobs->submit(order));
  ASSERT_TRUE(jobs->dismiss(last));
  order.client = shell("").client;
  EXPECT_TRUE(jobs->submit(order)) << "its place is free again";
}

TEST_F(JobsTest, OneClientsResultsLeaveRoomForOthers) {
  JobLimits limits;
  limits.stored_bytes = 60000, limits.stored_per_client = 31000, limits.each.file_bytes = 10000;
  const auto jobs = open(limits);
  const std::string make = "sleep 0.2; head -c 9000 /dev/zero > out.txt";
  std::vector<std::promise<Job>> ends(4);
  for (auto& end : ends)  // all have their place before the first has ended
    ASSERT_TRUE(jobs->submit(shell(make, "a"), [&end](const Job& job) { end.set_value(job); }));
  Job last;
  for (auto& end : ends) last = end.get_future().get();
  EXPECT_EQ(last.status, JobStatus::failed);
  EXPECT_EQ(last.exit_code, Job::kNoRoom);
  EXPECT_NE(last.message.find("results of your earlier jobs"), std::string::npos) << last.message;
  const auto more = jobs->submit(shell("true", "a"));
  ASSERT_FALSE(more);
  EXPECT_EQ(more.error().code, Errc::busy);
  EXPECT_NE(more.error().what.find("results of your earlier jobs"), std::string::npos);
  EXPECT_EQ(run(*jobs, shell(make, "b")).status, JobStatus::successful);
  const auto own = jobs->of_client("a", 10);
  ASSERT_TRUE(own);
  ASSERT_TRUE(jobs->dismiss(own->back().id));
  EXPECT_EQ(run(*jobs, shell(make, "a")).status, JobStatus::successful);
}

TEST_F(JobsTest, ThoseOfAClientWhoseResultsHaveNoRoomBesideItsOthersWaitForThem) {
  JobLimits limits;
  limits.running = 4;
  limits.stored_per_client = 25000, limits.each.file_bytes = 10000;  // of two at a time
  const auto jobs = open(limits);
  std::vector<std::promise<Job>> ends(7);
  for (std::size_t i = 0; i < ends.size(); ++i)
    ASSERT_TRUE(jobs->submit(shell("sleep 0.2", i < 6 ? "a" : "b"),
                             [&end = ends[i]](const Job& job) { end.set_value(job); }));
  std::size_t most = 0;
  for (auto& end : ends) {
    auto future = end.get_future();
    while (future.wait_for(10ms) != std::future_status::ready)
      most = std::max(most, jobs->counts().running);
    const Job job = future.get();
    EXPECT_EQ(job.status, JobStatus::successful) << job.message;
  }
  EXPECT_EQ(most, 3u) << "two of one, and the other's";
}

TEST_F(JobsTest, ResultsOfThoseThatWaitedFillTheStoreNoFurther) {
  JobLimits limits;
  limits.stored_bytes = 31000, limits.each.file_bytes = 10000;
  const auto jobs = open(limits);
  std::vector<std::promise<Job>> ends(6);
  for (auto& end : ends)  // all have their place before the first has ended
    ASSERT_TRUE(jobs->submit(shell("sleep 0.3; head -c 9000 /dev/zero > out.txt"),
                             [&end](const Job& job) { end.set_value(job); }));
  std::uint64_t stored = 0;
  std::size_t without_room = 0;
  for (auto& end : ends) {
    const Job job = end.get_future().get();
    stored += job.bytes;
    if (job.status != JobStatus::failed) continue;
    ++without_room;
    EXPECT_EQ(job.exit_code, Job::kNoRoom);
    EXPECT_NE(job.message.find("results of earlier jobs"), std::string::npos) << job.message;
  }
  EXPECT_LE(stored, limits.stored_bytes);
  EXPECT_EQ(without_room, 3u);
}

TEST_F(JobsTest, TheListOfWhatHasNoResultIsBounded) {
  const auto store = JobStore::open(dir_.file("list"));
  ASSERT_TRUE(store);
  for (int i = 0; i < 30; ++i) {
    Job job;
    job.id = "job" + std::to_string(10 + i), job.client = i % 3 ? "a" : "b";
    job.status = i % 5 ? JobStatus::dismissed : JobStatus::successful;
    job.created_ms = job.finished_ms = 1000 + i;
    ASSERT_TRUE((*store)->put(job));
  }
  ASSERT_TRUE((*store)->keep_latest(4));
  const auto count = [&](const char* client, JobStatus status) {
    const auto all = (*store)->of_client(client, 100);
    return std::ranges::count(*all, status, &Job::status);
  };
  EXPECT_EQ(count("a", JobStatus::dismissed), 4);
  EXPECT_EQ(count("b", JobStatus::dismissed), 4);
  EXPECT_EQ(count("a", JobStatus::successful) + count("b", JobStatus::successful), 6);
  EXPECT_TRUE(*(*store)->find("job39")) << "the latest stay";
  EXPECT_FALSE(*(*store)->find("job11"));
}

TEST_F(JobsTest, MessagesHaveNoPaths) {
  const auto jobs = open();
  EXPECT_EQ(
      run(*jobs, shell("echo 'tind: no grid: looked in /usr/share/a, /root/b; so' >&2; exit 65"))
          .message,
      "no grid: looked in ..., ...; so");
}

TEST_F(JobsTest, WhatIsKilledFromOutsideIsTriedOnceMore) {
  const auto jobs = open();
  const Job again = run(*jobs, shell("test -e ../once && echo a > out.txt && exit; "
                                     "touch ../once; kill -9 $$"));
  EXPECT_EQ(again.status, JobStatus::successful) << again.message;
  EXPECT_EQ(again.attempts, 2);
  const Job never = run(*jobs, shell("kill -9 $$"));
  EXPECT_EQ(never.status, JobStatus::failed);
  EXPECT_NE(never.message.find("from outside, twice"), std::string::npos) << never.message;
  const Job fault = run(*jobs, shell("kill -SEGV $$"));
  EXPECT_EQ(fault.attempts, 1);
  EXPECT_NE(fault.message.find("a bug"), std::string::npos) << fault.message;
  const Jobs::Counts counts = jobs->counts();
  EXPECT_EQ(counts.waiting + counts.running, 0u);
  EXPECT_EQ(counts.failed, 2u);
}

volatile std::sig_atomic_t told = 0;

/// A handler writes to a pipe, as the daemon's does: a child that is stopped before it is the
/// program must not write there.
TEST_F(JobsTest, WhatStopsAChildNeverReachesTheDaemon) {
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC | O_NONBLOCK), 0);
  told = ends[1];
  const auto usual = std::signal(SIGTERM, [](int) { (void)!::write(int(told), "!", 1); });
  {
    const auto jobs = open();
    for (int i = 0; i < 100; ++i) {
      const auto job = jobs->submit(shell("sleep 60"));
      ASSERT_TRUE(job);
      ASSERT_TRUE(
          becomes(*jobs, job->id, [](const Job& j) { return j.status != JobStatus::accepted; }));
      ASSERT_TRUE(jobs->dismiss(job->id));
      ASSERT_TRUE(becomes(*jobs, job->id, [](const Job& j) { return j.has_ended(); }));
    }
  }
  std::signal(SIGTERM, usual);
  char byte = 0;
  EXPECT_LT(::read(ends[0], &byte, 1), 0) << "the daemon was told to stop";
  ::close(ends[0]);
  ::close(ends[1]);
}

TEST_F(JobsTest, OldOnesExpire) {
  JobLimits limits;
  limits.kept = std::chrono::seconds(-1);
  const auto jobs = open(limits);
  const auto first = jobs->submit(shell("echo a > out.txt"));
  ASSERT_TRUE(first);
  for (int i = 0; i < 2000 && *jobs->find(first->id); ++i) std::this_thread::sleep_for(5ms);
  EXPECT_FALSE(*jobs->find(first->id));
  EXPECT_FALSE(fs::exists(folder(*first)));
}

}  // namespace
}  // namespace tind::services
