// A store that breaks in every way that we know of, at every kind of request: what comes out is
// right, or an error, after a bounded number of requests.

#include "terrain/raster/remote/objects.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "terrain/raster/remote/remote_file.h"
#include "tests/support/s3_stub.h"

namespace tind::remote {
namespace {

using Fault = S3Stub::Fault;
using testing::HasSubstr;
using testing::Not;

std::string some_bytes(std::size_t size) {
  std::string text;
  while (text.size() < size) text += std::to_string(text.size()) + " ";
  text.resize(size);
  return text;
}

std::string text_of(const std::vector<std::uint8_t>& bytes) { return {bytes.begin(), bytes.end()}; }

class ObjectsTest : public testing::Test {
 protected:
  S3Stub stub;

  S3Settings settings() const {
    return {.scheme = "http",
            .host = stub.address().substr(7),
            .bucket_in_host = false,
            .region = "us-east-1",
            .key = AwsKey{"id", "very-secret", ""},
            .wrong = {}};
  }
  /// Tries are many enough for a busy machine to be slow once; hanging ones are few.
  Objects objects(int tries = 3, int milliseconds = 20'000) const {
    return {settings(),
            {.answer = std::chrono::milliseconds(milliseconds),
             .pause = std::chrono::milliseconds(1),
             .tries = tries}};
  }
};

constexpr int kForGood = 1000;
// Three tries; where a connection that was kept is gone, libcurl begins a new one by itself.
constexpr int kMostRequests = 3 + 5;

constexpr Fault kPassing[] = {Fault::e500,      Fault::e503,       Fault::reset,
                              Fault::cut,       Fault::short_body, Fault::other_body,
                              Fault::error_200, Fault::no_length};

TEST_F(ObjectsTest, WhatPassesIsAskedForAgain) {
  const std::string bytes = some_bytes(5000);
  stub.put("b/x", bytes);
  for (const Fault fault : kPassing) {
    SCOPED_TRACE(int(fault));
    stub.fail_next("GET", fault, 2);
    const auto got = objects().get("s3://b/x", 10000);
    ASSERT_TRUE(got) << got.error().what;
    EXPECT_EQ(text_of(got->bytes), bytes);
  }
}

TEST_F(ObjectsTest, AKeyWithDotsIsThatOneAndNoOther) {
  stub.put("b/a/../x", "asked for");
  stub.put("b/x", "another");
  for (const char* const key : {"s3://b/a/../x", "s3://b/x"}) {
    const auto got = objects().get(key, 100);
    ASSERT_TRUE(got) << got.error().what;
    EXPECT_EQ(text_of(got->bytes), std::string(key) == "s3://b/x" ? "another" : "asked for");
  }
}

TEST_F(ObjectsTest, WhatDoesNotPassIsAnErrorNeverOtherBytes) {
  stub.put("b/x", some_bytes(5000));
  for (const Fault fault : kPassing) {
    SCOPED_TRACE(int(fault));
    const int before = stub.count("GET");
    stub.fail_next("GET", fault, kForGood);
    const auto got = objects().get("s3://b/x", 10000);
    ASSERT_FALSE(got);
    EXPECT_EQ(got.error().code, Errc::io) << got.error().what;
    EXPECT_LE(stub.count("GET") - before, kMostRequests);
    stub.mend();
  }
}

TEST_F(ObjectsTest, RangesAreExactlyThoseAskedForOrAnError) {
  const std::string bytes = some_bytes(200'000);
  stub.put("b/x", bytes);
  const auto state = objects().head("s3://b/x");
  ASSERT_TRUE(state) << state.error().what;
  for (const Fault fault :
       {Fault::e500, Fault::reset, Fault::cut, Fault::short_body, Fault::no_range,
        Fault::wrong_range, Fault::error_200, Fault::no_length}) {
    SCOPED_TRACE(int(fault));
    stub.fail_next("GET", fault, 2);
    const auto mended = objects().get_range("s3://b/x", *state, 70'000, 1000);
    ASSERT_TRUE(mended) << mended.error().what;
    EXPECT_EQ(text_of(*mended), bytes.substr(70'000, 1000));
    stub.fail_next("GET", fault, kForGood);
    const auto broken = objects().get_range("s3://b/x", *state, 70'000, 1000);
    ASSERT_FALSE(broken);
    EXPECT_EQ(broken.error().code, Errc::io) << broken.error().what;
    stub.mend();
  }
}

TEST_F(ObjectsTest, AnotherVersionIsToldFromTheOneThatWasOpened) {
  stub.put("b/x", some_bytes(200'000));
  const auto file = RemoteFile::open(objects(), "s3://b/x");
  ASSERT_TRUE(file) << file.error().what;
  EXPECT_TRUE((*file)->unchanged());
  stub.put("b/x", some_bytes(200'001));
  const auto read = (*file)->read(100'000, 10);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, Errc::busy) << read.error().what;
  std::vector<std::uint8_t> small(10);
  EXPECT_FALSE((*file)->read_kept(150'000, small));
  EXPECT_FALSE((*file)->unchanged());
}

TEST_F(ObjectsTest, FilesAreReadByBlocksThatAreKept) {
  const std::string bytes = some_bytes(500'000);
  stub.put("b/x", bytes);
  const auto file = RemoteFile::open(objects(), "s3://b/x");
  ASSERT_TRUE(file) << file.error().what;
  for (const auto& [at, size] : std::vector<std::pair<std::size_t, std::size_t>>{
           {0, 10}, {65'530, 20}, {100'000, 300'000}, {499'999, 1}, {0, 500'000}}) {
    std::vector<std::uint8_t> to(size);
    ASSERT_TRUE((*file)->read_kept(at, to));
    EXPECT_EQ(text_of(to), bytes.substr(at, size));
  }
  const int asked = stub.count("GET");
  std::vector<std::uint8_t> again(1000);
  ASSERT_TRUE((*file)->read_kept(200'000, again));
  EXPECT_EQ(stub.count("GET"), asked);
  EXPECT_FALSE((*file)->read_kept(499'999, std::span(again).first(2)));
  // A failure is not kept.
  const auto other = RemoteFile::open(objects(1), "s3://b/x");
  ASSERT_TRUE(other);
  stub.fail_next("GET", Fault::e500, 1);
  EXPECT_FALSE((*other)->read_kept(200'000, again));
  EXPECT_TRUE((*other)->read_kept(200'000, again));
  EXPECT_EQ(text_of(again), bytes.substr(200'000, 1000));
}

TEST_F(ObjectsTest, ABlockThatManyWantAtOnceIsAskedForOnce) {
  const std::string bytes = some_bytes(500'000);
  stub.put("b/x", bytes);
  const auto file = RemoteFile::open(objects(), "s3://b/x");
  ASSERT_TRUE(file) << file.error().what;
  const int before = stub.count("GET");
  const auto read_by_many = [&](std::size_t at) {
    std::atomic<int> good = 0;
    std::vector<std::jthread> readers;
    for (std::size_t k = 0; k < 8; ++k)
      readers.emplace_back([&, k] {
        std::vector<std::uint8_t> to(1000);
        const std::size_t from = at + 1000 * k;
        good += (*file)->read_kept(from, to) && text_of(to) == bytes.substr(from, 1000);
      });
    readers.clear();
    return good.load();
  };
  EXPECT_EQ(read_by_many(200'000), 8);
  EXPECT_EQ(stub.count("GET"), before + 1);
  EXPECT_EQ(read_by_many(255'000), 8) << "across the end of the block";
  EXPECT_EQ(stub.count("GET"), before + 2);
  // All who wait for an answer hear of its failure, and the next one asks anew.
  stub.fail_next("GET", Fault::e403, kForGood);
  EXPECT_EQ(read_by_many(400'000), 0);
  stub.mend();
  EXPECT_EQ(read_by_many(400'000), 8);
}

TEST_F(ObjectsTest, RefusalsAndAbsenceAreSaidAtOnce) {
  stub.put("b/x", "x");
  stub.fail_next("GET", Fault::e403, 9);
  const auto refused = objects().get("s3://b/x", 10);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, Errc::io);
  EXPECT_THAT(refused.error().what, HasSubstr("AccessDenied"));
  EXPECT_THAT(refused.error().what, Not(HasSubstr("very-secret")));
  EXPECT_EQ(stub.count("GET"), 1);
  stub.mend();
  EXPECT_EQ(objects().get("s3://b/none", 10).error().code, Errc::not_found);
  EXPECT_EQ(objects().head("s3://b/none").error().code, Errc::not_found);
  EXPECT_EQ(stub.count("GET"), 2);
  stub.fail_next("GET", Fault::redirect, 1);
  const auto elsewhere = objects().get("s3://b/x", 10);
  ASSERT_FALSE(elsewhere);
  EXPECT_EQ(elsewhere.error().code, Errc::io);
  EXPECT_EQ(stub.count("GET"), 3);
}

TEST_F(ObjectsTest, WhatIsWrittenIsThereOrAnError) {
  const std::string bytes = some_bytes(5000);
  for (const Fault fault : {Fault::e500, Fault::e503, Fault::reset, Fault::error_200, Fault::lost,
                            Fault::lie, Fault::half_done}) {
    SCOPED_TRACE(int(fault));
    stub.erase("b/x");
    stub.fail_next("PUT", fault, 2);
    const auto put = objects().put("s3://b/x", bytes, "text/plain");
    ASSERT_TRUE(put) << put.error().what;
    EXPECT_EQ(stub.objects().at("b/x"), bytes);
    stub.mend();
    stub.erase("b/x");
    stub.fail_next("PUT", fault, kForGood);
    const auto broken = objects().put("s3://b/x", bytes, "text/plain");
    if (fault == Fault::lost) {  // it was written, whatever the store said
      EXPECT_TRUE(broken);
    } else {
      ASSERT_FALSE(broken);
      EXPECT_EQ(broken.error().code, Errc::io) << broken.error().what;
    }
    stub.mend();
  }
  stub.fail_next("PUT", Fault::e403, 1);
  EXPECT_FALSE(objects().put("s3://b/x", bytes, "text/plain"));
  EXPECT_EQ(stub.wrong_digests(), 0);
}

TEST_F(ObjectsTest, ALookAfterwardsThatFailsIsNoProof) {
  for (const Fault fault : {Fault::e500, Fault::reset, Fault::e403}) {
    SCOPED_TRACE(int(fault));
    stub.fail_next("HEAD", fault, kForGood);
    EXPECT_FALSE(objects().put("s3://b/x", "bytes", "text/plain"));
    stub.mend();
    stub.fail_next("HEAD", fault == Fault::e403 ? Fault::e500 : fault, 2);
    EXPECT_TRUE(objects().put("s3://b/x", "bytes", "text/plain"));
    stub.mend();
  }
}

TEST_F(ObjectsTest, ListsAreWholeOrAnError) {
  for (int k = 0; k < 120; ++k)
    stub.put("b/tiles/" + std::to_string(1000 + k), some_bytes(std::size_t(k)));
  stub.put("b/tiles/a&b", "x");
  stub.put("b/other", "x");
  const auto all = objects().list("s3://b/tiles/");
  ASSERT_TRUE(all) << all.error().what;
  ASSERT_EQ(all->size(), 121u);
  EXPECT_EQ((*all)[7].key, "1007");
  EXPECT_EQ((*all)[7].size, 7u);
  EXPECT_EQ((*all)[7].etag.size(), 32u);
  EXPECT_EQ(all->back().key, "a&b");
  for (const Fault fault :
       {Fault::e500, Fault::reset, Fault::cut, Fault::short_body, Fault::error_200}) {
    SCOPED_TRACE(int(fault));
    stub.fail_next("LIST", fault, 2, "token=");  // of the second page
    const auto mended = objects().list("s3://b/tiles/");
    ASSERT_TRUE(mended) << mended.error().what;
    EXPECT_EQ(mended->size(), 121u);
    stub.fail_next("LIST", fault, kForGood, "token=");
    const auto broken = objects().list("s3://b/tiles/");
    ASSERT_FALSE(broken);
    EXPECT_EQ(broken.error().code, Errc::io) << broken.error().what;
    stub.mend();
  }
}

TEST_F(ObjectsTest, AServerThatDoesNotAnswerIsGivenUp) {
  stub.put("b/x", "x");
  for (const char* kind : {"GET", "HEAD", "PUT", "LIST"}) {
    SCOPED_TRACE(kind);
    stub.fail_next(kind, Fault::hang, kForGood);
    const Objects hasty = objects(1, 100);
    const std::string name = kind;
    const bool ok = name == "GET"    ? hasty.get("s3://b/x", 10).has_value()
                    : name == "HEAD" ? hasty.head("s3://b/x").has_value()
                    : name == "PUT"  ? hasty.put("s3://b/new", "y", "text/plain").has_value()
                                     : hasty.list("s3://b/").has_value();
    EXPECT_FALSE(ok);
    EXPECT_LE(stub.count(kind), 2);  // a look after the PUT
    stub.mend();
  }
  stub.fail_next("GET", Fault::hang, 1);
  EXPECT_TRUE(objects(4, 3000).get("s3://b/x", 10));
}

TEST_F(ObjectsTest, PlainServersAreReadByRangesOfThisMachineOrHttps) {
  stub.put("dir/x.tif", some_bytes(100));
  const std::string url = stub.address() + "/dir/x.tif";
  EXPECT_TRUE(objects().get_first(url, 50));
  EXPECT_EQ(objects().put(url, "x", "text/plain").error().code, Errc::unsupported);
  for (const char* place : {"http://example.com/x.tif", "https://user:word@localhost/x", "s3:///x",
                            "s3://b?x/y", "ftp://localhost/x", "http://127.0.0.1.example.com/x"}) {
    SCOPED_TRACE(place);
    const auto got = objects().head(place);
    ASSERT_FALSE(got);
    EXPECT_EQ(got.error().code, Errc::invalid_argument) << got.error().what;
  }
}

TEST(S3Settings, OfTheEnvironment) {
  const auto with = [](std::vector<std::pair<const char*, const char*>> values) {
    for (const auto& [name, value] : values) ::setenv(name, value, 1);
    S3Settings s = S3Settings::of_environment();
    for (const auto& [name, value] : values) ::unsetenv(name);
    return s;
  };
  EXPECT_FALSE(with({}).wrong.empty());
  const auto plain = with(
      {{"AWS_ACCESS_KEY_ID", "a"}, {"AWS_SECRET_ACCESS_KEY", "b"}, {"AWS_REGION", "eu-north-1"}});
  EXPECT_TRUE(plain.wrong.empty());
  EXPECT_EQ(plain.host, "s3.eu-north-1.amazonaws.com");
  EXPECT_TRUE(plain.bucket_in_host);
  const auto own = with(
      {{"AWS_NO_SIGN_REQUEST", "YES"}, {"AWS_S3_ENDPOINT", "localhost:9000"}, {"AWS_HTTPS", "NO"}});
  EXPECT_TRUE(own.wrong.empty());
  EXPECT_EQ(own.scheme + "://" + own.host, "http://localhost:9000");
  EXPECT_FALSE(own.bucket_in_host);
  EXPECT_FALSE(own.key);
  EXPECT_FALSE(
      with({{"AWS_NO_SIGN_REQUEST", "YES"}, {"AWS_ENDPOINT_URL", "localhost"}}).wrong.empty());
}

}  // namespace
}  // namespace tind::remote
