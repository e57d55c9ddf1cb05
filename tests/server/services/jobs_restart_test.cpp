// The list and the folders of jobs: what is left of them when a daemon ends, however it does.

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

#include "server/services/jobs/jobs.h"
#include "tests/server/services/jobs_fixture.h"

namespace tind::services {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

TEST_F(JobsTest, ARestartGoesOnOnceAndForgetsNothing) {
  std::string done, running, waiting;
  {
    const auto jobs = open();
    done = run(*jobs, shell("echo kept > out.txt")).id;
    // Fails at its first attempt's end by the stop, and makes its file in the second.
    running = jobs->submit(shell("test -e ../again && echo again > out.txt && exit; sleep 60"))->id;
    waiting = jobs->submit(shell("echo later > out.txt"))->id;
    ASSERT_TRUE(
        becomes(*jobs, running, [](const Job& j) { return j.status == JobStatus::running; }));
  }
  std::ofstream(dir_.file("jobs/again")) << "";
  fs::create_directories(dir_.file("jobs/0123456789abcdef0123456789abcdef"));  // nobody's
  fs::create_directories(dir_.file("jobs/mine"));                              // somebody else's
  const auto jobs = open();
  for (const std::string& id : {done, running, waiting}) {
    ASSERT_TRUE(becomes(*jobs, id, [](const Job& j) { return j.has_ended(); }));
    const Job job = **jobs->find(id);
    EXPECT_EQ(job.status, JobStatus::successful) << job.message;
    EXPECT_TRUE(fs::exists(folder(job) + "/out.txt"));
  }
  EXPECT_FALSE(fs::exists(dir_.file("jobs/0123456789abcdef0123456789abcdef")));
  EXPECT_TRUE(fs::exists(dir_.file("jobs/mine")));
}

TEST_F(JobsTest, BesideANewListFoldersAreAnybodysAndStay) {
  const std::string others = dir_.file("jobs/d41d8cd98f00b204e9800998ecf8427e");
  fs::create_directories(others);
  std::ofstream(others + "/precious") << "x";
  EXPECT_FALSE(open()->find("d41d8cd98f00b204e9800998ecf8427e")->has_value());
  EXPECT_TRUE(fs::exists(others + "/precious"));
}

TEST_F(JobsTest, WhatItMakesIsNobodyElsesToRead) {
  open();
  EXPECT_EQ(fs::status(dir_.file("jobs")).permissions(), fs::perms::owner_all);
}

TEST_F(JobsTest, TheListOfAClientIsWithoutOrdersAndUpToDate) {
  const auto jobs = open();
  const std::string ended = run(*jobs, shell("echo a > out.txt")).id;
  const std::string lasts = jobs->submit(shell("sleep 60"))->id;
  ASSERT_TRUE(becomes(*jobs, lasts, [](const Job& j) { return j.status == JobStatus::running; }));
  const auto list = jobs->of_client("1.2.3.4", 10);
  ASSERT_TRUE(list);
  ASSERT_EQ(list->size(), 2u);
  for (const Job& job : *list) {
    EXPECT_EQ(job.order == nullptr, job.id == ended) << "of what has not ended it is at hand";
    EXPECT_EQ(job.process, "test");
    EXPECT_EQ(job.status, job.id == lasts ? JobStatus::running : JobStatus::successful);
    EXPECT_GT(job.started_ms, 0);
  }
  EXPECT_TRUE((*jobs->find(ended))->order);
}

/// As a daemon leaves a list that was killed: what it wrote last stays.
void edit(const std::string& path, const std::string& sql) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(db);
}

TEST_F(JobsTest, WhatSomebodyWaitedForIsNotRunForNobody) {
  std::string waited, kept;
  {
    const auto jobs = open();
    waited = run(*jobs, shell("echo a > out.txt")).id;
    kept = jobs->submit(shell("echo b > out.txt"))->id;
    ASSERT_TRUE(becomes(*jobs, kept, [](const Job& j) { return j.has_ended(); }));
  }
  // As if the daemon had been killed while both ran.
  edit(dir_.file("jobs/jobs.sqlite"), "UPDATE job SET status = 1, finished = 0, attempts = 1");
  const auto jobs = open();
  ASSERT_TRUE(becomes(*jobs, waited, [](const Job& j) { return j.has_ended(); }));
  EXPECT_EQ((*jobs->find(waited))->status, JobStatus::dismissed);
  ASSERT_TRUE(becomes(*jobs, kept, [](const Job& j) { return j.has_ended(); }));
  EXPECT_NE((*jobs->find(kept))->status, JobStatus::dismissed);
}

TEST_F(JobsTest, WhatTheyWereGivenIsThereAfterARestart) {
  JobOrder order = shell("test -e ../again || sleep 60; cat mesh.txt > out.txt");
  order.files["mesh.txt"] = "a mesh";
  std::string first, second;
  {
    const auto jobs = open();
    first = jobs->submit(order)->id, second = jobs->submit(order)->id;
    ASSERT_TRUE(becomes(*jobs, first, [](const Job& j) { return j.status == JobStatus::running; }));
  }
  std::ofstream(dir_.file("jobs/again")) << "";
  const auto jobs = open();
  for (const std::string& id : {first, second}) {
    ASSERT_TRUE(becomes(*jobs, id, [](const Job& j) { return j.has_ended(); }));
    EXPECT_EQ(content(dir_.file("jobs/" + id + "/out.txt")), "a mesh");
  }
}

TEST_F(JobsTest, AfterARestartItIsNotRunOfOtherFilesThanItWasAcceptedFor) {
  std::string same, other;
  const std::string a = dir_.file("a.tif"), b = dir_.file("b.tif");
  std::ofstream(a) << "heights", std::ofstream(b) << "heights";
  {
    const auto jobs = open();
    JobOrder order = shell("test -e ../again && echo again > out.txt && exit; sleep 60");
    order.names = {{a, "alps"}};
    same = jobs->submit(order)->id;
    order.names = {{b, "berge"}};
    other = jobs->submit(order)->id;
    ASSERT_TRUE(becomes(*jobs, same, [](const Job& j) { return j.status == JobStatus::running; }));
  }
  std::ofstream(dir_.file("jobs/again")) << "";
  std::ofstream(b) << "others";
  const auto jobs = open();
  for (const std::string& id : {same, other})
    ASSERT_TRUE(becomes(*jobs, id, [](const Job& j) { return j.has_ended(); }));
  EXPECT_EQ((*jobs->find(same))->status, JobStatus::successful) << (*jobs->find(same))->message;
  EXPECT_EQ((*jobs->find(other))->status, JobStatus::failed);
}

TEST_F(JobsTest, AnOrderlyStopIsNoAttempt) {
  std::string id;
  for (int i = 0; i < 4; ++i) {
    const auto jobs = open();
    if (i == 0) id = jobs->submit(shell("sleep 60"))->id;
    ASSERT_TRUE(becomes(
        *jobs, id, [](const Job& j) { return j.status == JobStatus::running && j.attempts == 1; }));
  }
}

TEST_F(JobsTest, AnOrderThatCannotBeReadFails) {
  std::string id, done;
  {
    const auto jobs = open();
    done = run(*jobs, shell("echo a > out.txt")).id;
    id = jobs->submit(shell("sleep 60"))->id;
    ASSERT_TRUE(becomes(*jobs, id, [](const Job& j) { return j.status == JobStatus::running; }));
  }
  edit(dir_.file("jobs/jobs.sqlite"), "UPDATE job SET work = 'garbage'");
  const auto jobs = open();
  ASSERT_TRUE(becomes(*jobs, id, [](const Job& j) { return j.has_ended(); }));
  EXPECT_EQ((*jobs->find(id))->status, JobStatus::failed);
  EXPECT_TRUE(order_of(**jobs->find(done)).outputs.empty());
}

TEST_F(JobsTest, WhatTakesTheDaemonAlongTwiceIsNotTriedAgain) {
  std::string id;
  {
    const auto jobs = open();
    id = jobs->submit(shell("sleep 60"))->id;
    ASSERT_TRUE(becomes(*jobs, id, [](const Job& j) { return j.status == JobStatus::running; }));
  }
  edit(dir_.file("jobs/jobs.sqlite"), "UPDATE job SET attempts = 2, status = 1");
  const auto jobs = open();
  const Job job = **jobs->find(id);
  EXPECT_EQ(job.status, JobStatus::failed);
  EXPECT_NE(job.message.find("twice"), std::string::npos) << job.message;
}

TEST_F(JobsTest, OneDaemonAFolder) {
  const auto jobs = open();
  const auto other = Jobs::open(dir_.file("jobs"), "/bin/sh", {});
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, Errc::busy) << other.error().what;
}

TEST_F(JobsTest, AListOfSomethingElseIsLeftAlone) {
  fs::create_directories(dir_.file("jobs"));
  const std::string path = dir_.file("jobs/jobs.sqlite");
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(db, "CREATE TABLE mine (a)", nullptr, nullptr, nullptr), SQLITE_OK);
  sqlite3_close(db);
  const auto jobs = Jobs::open(dir_.file("jobs"), "/bin/sh", {});
  ASSERT_FALSE(jobs);
  EXPECT_EQ(jobs.error().code, Errc::bad_data);
  std::ofstream(path) << "no database at all, but long enough to be looked at";
  EXPECT_FALSE(Jobs::open(dir_.file("jobs"), "/bin/sh", {}));
}

TEST_F(JobsTest, ATemporaryFolderGoesWithTheDaemon) {
  fs::path where;
  {
    auto jobs = Jobs::open("", "/bin/sh", {});
    ASSERT_TRUE(jobs);
    const JobOrder order = shell("echo a > out.txt");
    const Job job = run(**jobs, order);
    where = (*jobs)->path_of(job, order.outputs[0]);
    EXPECT_TRUE(fs::exists(where));
  }
  EXPECT_FALSE(fs::exists(where.parent_path().parent_path()));
}

TEST_F(JobsTest, TheTemporaryFolderOfAKilledDaemonGoesWithTheNext) {
  const auto folder_with_list = [&](const std::string& name, bool old) {
    fs::create_directory(dir_.file(name));
    ASSERT_TRUE(JobStore::open(dir_.file(name + "/jobs.sqlite")));
    const auto now = fs::file_time_type::clock::now();
    fs::last_write_time(dir_.file(name + "/jobs.sqlite"), old ? now - 1h : now);
  };
  folder_with_list("tind-jobs-killed", true);
  folder_with_list("tind-jobs-young", false);
  folder_with_list("tind-jobs-held", true);
  folder_with_list("of-others", true);
  fs::create_directory(dir_.file("tind-jobs-without"));
  const auto holder = JobStore::open(dir_.file("tind-jobs-held/jobs.sqlite"));
  fs::last_write_time(dir_.file("tind-jobs-held/jobs.sqlite"),
                      fs::file_time_type::clock::now() - 1h);
  const char* const before = std::getenv("TMPDIR");
  const std::string usual = before ? before : "";
  ::setenv("TMPDIR", dir_.file("").c_str(), 1);
  ASSERT_TRUE(Jobs::open("", "/bin/sh", {}));
  before ? ::setenv("TMPDIR", usual.c_str(), 1) : ::unsetenv("TMPDIR");
  EXPECT_FALSE(fs::exists(dir_.file("tind-jobs-killed")));
  for (const char* kept : {"tind-jobs-young", "tind-jobs-held", "of-others", "tind-jobs-without"})
    EXPECT_TRUE(fs::exists(dir_.file(kept))) << kept;
}

}  // namespace
}  // namespace tind::services
