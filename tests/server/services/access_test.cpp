#include <gtest/gtest.h>

#include <random>
#include <set>

#include "server/services/access/keys.h"
#include "server/services/access/token_bucket.h"
#include "server/services/datasets/key_table.h"

namespace tind::services {
namespace {

constexpr Nanoseconds kSecond = 1'000'000'000;

TEST(TokenBucket, PassesWhatTheRateAllowsWhateverTheyComeAt) {
  std::mt19937_64 random(7);
  for (const Rate rate : {Rate{10, 5}, Rate{0.5, 4}, Rate{1000, 50}, Rate{3, 0}}) {
    TokenBucket bucket;
    Nanoseconds now = 12345;
    std::size_t passed = 0;
    const double mean = 1e9 / rate.per_second / 3;  // three times too many
    const Nanoseconds begin = now;
    for (int i = 0; i < 20'000; ++i) {
      now += Nanoseconds(std::exponential_distribution<double>(1 / mean)(random));
      passed += bucket.take(rate, now).passed;
      const double most = rate.most_at_once() + rate.per_second * double(now - begin) / 1e9;
      ASSERT_LE(double(passed), most + 1e-3);
    }
    const double most = rate.most_at_once() + rate.per_second * double(now - begin) / 1e9;
    EXPECT_GT(double(passed), 0.95 * most) << rate.per_second;
  }
}

TEST(TokenBucket, SaysWhatIsLeftAndWhenToComeAgain) {
  TokenBucket bucket;
  const Rate rate{2, 3};
  for (const int left : {2, 1, 0}) {
    const Taken taken = bucket.take(rate, kSecond);
    EXPECT_TRUE(taken.passed);
    EXPECT_EQ(taken.left, left);
  }
  const Taken refused = bucket.take(rate, kSecond);
  EXPECT_FALSE(refused.passed);
  EXPECT_EQ(refused.again, kSecond / 2);
  EXPECT_FALSE(bucket.take(rate, kSecond + refused.again - 1).passed);
  EXPECT_TRUE(bucket.take(rate, kSecond + refused.again).passed);
  EXPECT_TRUE(bucket.is_full(10 * kSecond));
}

TEST(Keys, SecretsAreLongAndNeverTheSame) {
  std::set<std::string> seen;
  for (int i = 0; i < 100; ++i) {
    const auto secret = make_secret();
    ASSERT_TRUE(secret);
    EXPECT_EQ(secret->size(), 48u);
    EXPECT_TRUE(seen.insert(*secret).second);
  }
}

TEST(Keys, AreFoundByTheirSecretAlone) {
  std::vector<Key> keys(3);
  for (std::size_t k = 0; k < keys.size(); ++k)
    keys[k].hash = sha256("secret " + std::to_string(k));
  EXPECT_EQ(find_key(keys, "secret 0"), &keys[0]);
  EXPECT_EQ(find_key(keys, "secret 2"), &keys[2]);
  EXPECT_EQ(find_key(keys, "secret 3"), nullptr);
  EXPECT_EQ(find_key(keys, ""), nullptr);
  EXPECT_EQ(find_key(keys, hex_of(keys[0].hash)), nullptr) << "a hash is no key";
}

TEST(Keys, ADayOfExpiryCountsToItsEnd) {
  using namespace std::chrono;
  EXPECT_EQ(time_of("2027-01-31"), sys_days(2027y / February / 1));
  EXPECT_EQ(time_of("2027-01-31T12:30:01Z"), sys_days(2027y / January / 31) + 12h + 30min + 1s);
  for (const char* const bad : {"", "2027", "2027-13-01", "2027-02-30", "2027-01-31T12:30:01",
                                "2027-01-31T24:00:00Z", "2027-01-31 ", "27-01-31", "2027--1-31"})
    EXPECT_FALSE(time_of(bad)) << bad;
}

constexpr const char* kHash = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

Result<Key> key_of(const std::string& text) {
  const auto table = parse_toml(text, "t.toml");
  if (!table) return std::unexpected(table.error());
  return read_key_table({.line = 1, .is_text = false, .value = *table}, "t.toml");
}

TEST(KeyTable, IsReadAndPrinted) {
  const std::string text = std::string("name = \"ann\"\nsha256 = \"") + kHash +
                           "\"\nscopes = [\"tiles\", \"jobs\"]\ndatasets = [\"alps\"]\nrate = 2.5\n"
                           "burst = 7\nexpires = \"2027-01-31T00:00:00Z\"\n";
  const auto key = key_of(text);
  ASSERT_TRUE(key) << key.error().what;
  EXPECT_EQ(key->hash, sha256(std::string_view("abc")));
  EXPECT_EQ(key->scopes, (std::vector{http::Scope::tiles, http::Scope::jobs}));
  EXPECT_EQ(key->datasets, std::vector<std::string>{"alps"});
  EXPECT_EQ(key->rate.per_second, 2.5);
  EXPECT_EQ(print_key_table(*key), "\n[[key]]\n" + text);
}

TEST(KeyTable, WhatIsWrongIsNamed) {
  const std::string good =
      std::string("name = \"ann\"\nsha256 = \"") + kHash + "\"\nscopes = [\"read\"]\n";
  EXPECT_TRUE(key_of(good));
  const std::pair<std::string, std::string> cases[] = {
      {"name = \"ann\"\nscopes = [\"read\"]\n", "sha256"},
      {std::string("name = \"a\"\nsha256 = \"") + kHash + "\"\n", "scopes"},
      {std::string("sha256 = \"") + kHash + "\"\nscopes = [\"read\"]\n", "name"},
      {"name = \"ann\"\nsha256 = \"abc\"\nscopes = [\"read\"]\n", "sha256"},
      {good + "rate = \"fast\"\n", "rate"},
      {good + "burst = 5\n", "rate"},
      {good + "expires = \"soon\"\n", "expires"},
      {good + "dataset = \"alps\"\n", "datasets"},
      {good + "datasets = []\n", "datasets"},
  };
  for (const auto& [text, culprit] : cases) {
    const auto key = key_of(text);
    ASSERT_FALSE(key) << text;
    EXPECT_NE(key.error().what.find(culprit), std::string::npos) << key.error().what;
    EXPECT_TRUE(key.error().what.starts_with("t.toml:")) << key.error().what;
  }
}

TEST(Origins, AreSchemesAndHosts) {
  EXPECT_EQ(origins_of("https://a.example,http://localhost:5173")->size(), 2u);
  EXPECT_EQ(origins_of("*")->size(), 1u);
  EXPECT_TRUE(origins_of("")->empty());
  for (const char* const bad : {"a.example", "https://a.example/", "https://", "https://a b"})
    EXPECT_FALSE(origins_of(bad)) << bad;
}

}  // namespace
}  // namespace tind::services
