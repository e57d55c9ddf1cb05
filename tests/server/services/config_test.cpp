#include "server/services/datasets/config.h"

#include <gtest/gtest.h>

#include <fstream>

#include "server/services/datasets/open_dataset.h"
#include "tests/support/support.h"

namespace tind::services {
namespace {

class ConfigTest : public ::testing::Test {
 protected:
  Result<Config> read(const std::string& toml) {
    if (!toml.empty()) {
      input_.file = dir_.file("tind.toml");
      std::ofstream(input_.file) << toml;
    }
    input_.environment = [this](const std::string& key) -> std::optional<std::string> {
      const auto found = environment_.find(key);
      return found == environment_.end() ? std::nullopt : std::optional(found->second);
    };
    return read_config(input_);
  }
  std::string error(const std::string& toml) {
    const auto config = read(toml);
    return config ? "no error" : config.error().what;
  }

  test::TempDir dir_;
  ConfigInput input_;
  std::map<std::string, std::string> environment_;
};

TEST_F(ConfigTest, FlagBeatsEnvironmentBeatsFileBeatsDefault) {
  environment_["TIND_QUEUE"] = "3";
  environment_["TIND_CACHE_MB"] = "33";
  input_.flags["cache-mb"] = "44";
  const auto config = read("threads = 1\nqueue = 2\ncache_mb = 22\n");
  ASSERT_TRUE(config) << config.error().what;
  EXPECT_EQ(config->threads, 1);
  EXPECT_EQ(config->queue, 3);
  EXPECT_EQ(config->cache_mb, 44);
  EXPECT_EQ(config->build_threads, Config{}.build_threads);
}

TEST_F(ConfigTest, ReadsEveryKind) {
  const auto config = read(
      "datasets = [\"a.tif\", \"b=c.tif,d.tif\"]\nlisten = \"[::1]:80\"\nmax_error = 2\n"
      "error_factor = 0.5\nallow_vrt = true\nfrom_datum = \"egm96\"\n");
  ASSERT_TRUE(config) << config.error().what;
  EXPECT_EQ(config->datasets, (std::vector<std::string>{"a.tif", "b=c.tif,d.tif"}));
  EXPECT_EQ(config->listen, "[::1]:80");
  const auto options = dataset_options(config->every, {});
  ASSERT_TRUE(options) << options.error().what;
  EXPECT_EQ(options->tiles.max_error_m, 2);
  EXPECT_EQ(options->tiles.error_factor, 0.5);
  EXPECT_TRUE(options->dem.allow_vrt);
  EXPECT_EQ(options->dem.from_datum, VerticalDatum::egm96);
  input_.datasets = {"x.tif"};
  EXPECT_EQ(read("datasets = [\"a.tif\"]\n")->datasets, std::vector<std::string>{"x.tif"});
}

TEST_F(ConfigTest, UnknownKeysAreErrorsWithASuggestion) {
  const std::string wrong = error("threads = 1\ncahe_mb = 3\n");
  EXPECT_NE(wrong.find("tind.toml:2: unknown key cahe_mb; did you mean cache_mb?"),
            std::string::npos)
      << wrong;
  EXPECT_NE(error("dataset = []\n").find("did you mean datasets?"), std::string::npos);
  EXPECT_NE(error("xyzzy = 1\n").find("--print-config"), std::string::npos);
}

TEST_F(ConfigTest, UnknownVariablesAreErrorsWithASuggestion) {
  input_.environment_names = {"HOME",
                              "TIND_DATA",
                              "TIND_QUEUE",
                              "TIND_PORT",
                              "TIND_SERVICE_HOST",
                              "TIND_PORT_8080_TCP",
                              "TIND_REMOTE_TIMEOUT",
                              "TIND_REMOTE_TRIES",
                              "TIND_KEY"};
  EXPECT_EQ(error("threads = 1\n"), "no error");
  input_.environment_names.push_back("TIND_CACHE_MBS");
  const std::string wrong = error("threads = 1\n");
  EXPECT_NE(wrong.find("unknown variable TIND_CACHE_MBS; did you mean TIND_CACHE_MB?"),
            std::string::npos)
      << wrong;
}

TEST_F(ConfigTest, WrongValuesNameTheirPlace) {
  EXPECT_NE(error("queue = -1\n").find("tind.toml:1: queue must be a number from 0 to"),
            std::string::npos);
  EXPECT_NE(error("queue = \"many\"\n").find("not \"many\""), std::string::npos);
  EXPECT_NE(error("queue = 1.5\n").find("queue must be"), std::string::npos);
  EXPECT_NE(error("queue = [1]\n").find("plain value"), std::string::npos);
  EXPECT_NE(error("from_datum = \"nonsense\"\n").find("tind.toml:1: from-datum"),
            std::string::npos);
  EXPECT_NE(error("allow_vrt = 1\n").find("true or false"), std::string::npos);
  EXPECT_NE(error("datasets = \"a.tif\"\n").find("list of strings"), std::string::npos);
  EXPECT_NE(error("datasets = [1]\n").find("list of strings"), std::string::npos);
  EXPECT_NE(error("max_error = nan\n").find("max-error must be"), std::string::npos);
  EXPECT_NE(error("threads = \n").find("tind.toml:1"), std::string::npos);
  environment_["TIND_QUEUE"] = "x";
  EXPECT_NE(error("threads = 1\n").find("TIND_QUEUE: queue must be"), std::string::npos);
  input_.file = dir_.file("missing.toml");
  EXPECT_FALSE(read(""));
}

TEST_F(ConfigTest, WhatWouldLockEverybodyOutOrLetNobodyInIsRefused) {
  for (const char* const bad :
       {"rate_per_address = 1e-12\n", "rate_per_address = 10\nburst_per_address = 0.5\n",
        "burst_per_address = 5\n", "jobs_stored_mb = 100\n", "jobs_stored_mb_per_client = 100\n"})
    EXPECT_FALSE(read(bad)) << bad;
  for (const char* const good :
       {"rate_per_address = 0.001\n", "rate_per_address = 10\nburst_per_address = 1\n",
        "rate_per_address = 0\nburst_per_address = 0\n",
        "jobs_stored_mb = 100\njobs_result_mb = 100\n", "jobs_stored_mb = 100\njobs = 0\n",
        "jobs_stored_mb_per_client = 512\n"})
    EXPECT_TRUE(read(good)) << good;
}

TEST_F(ConfigTest, WhatIsPrintedCanBeRead) {
  Config config;
  config.datasets = {"a \"b\" \\ c.tif", "d=e.tif,f.tif"};
  config.every = {{"max-error", "0.25"}, {"allow-vrt", "true"}};
  config.grace = 1.5;
  config.viewer = "/some where";
  const std::string printed = print_config(config);
  const auto again = read(printed);
  ASSERT_TRUE(again) << again.error().what << "\n" << printed;
  EXPECT_EQ(print_config(*again), printed);
  EXPECT_EQ(again->datasets, config.datasets);
}

TEST(ParseListen, TakesWhatPeopleWrite) {
  const auto text = [](const char* listen) {
    const auto parsed = parse_listen(listen);
    return parsed ? parsed->address + " " + std::to_string(parsed->port) : "bad";
  };
  EXPECT_EQ(text("127.0.0.1:8080"), "127.0.0.1 8080");
  EXPECT_EQ(text("0.0.0.0:0"), "0.0.0.0 0");
  EXPECT_EQ(text("[::1]:80"), "::1 80");
  EXPECT_EQ(text(":80"), "127.0.0.1 80");
  EXPECT_EQ(text("8080"), "127.0.0.1 8080");
  EXPECT_EQ(text("localhost:80"), "127.0.0.1 80");
  for (const char* bad : {"", ":", "a:b", "1.2.3.4:", "1.2.3.4:65536", "1.2.3.4:-1", "::1:80",
                          "example.org:80", "1.2.3:80", "[::g]:80"})
    EXPECT_EQ(text(bad), "bad") << bad;
}

TEST(DatasetSpec, NamesAndJoinsFiles) {
  const auto spec = parse_dataset_spec("alps=a.tif,b.tif");
  EXPECT_EQ(spec.name, "alps");
  EXPECT_EQ(spec.files, (std::vector<std::string>{"a.tif", "b.tif"}));
  EXPECT_EQ(parse_dataset_spec("a.tif").files, std::vector<std::string>{"a.tif"});
  EXPECT_EQ(parse_dataset_spec("a.tif").name, "");
  test::TempDir dir;
  const std::string odd = dir.file("a=b,c.tif");
  std::ofstream(odd) << "x";
  EXPECT_EQ(parse_dataset_spec(odd).files, std::vector<std::string>{odd});
}

TEST(SafeName, KeepsWhatIsSafe) {
  EXPECT_EQ(safe_name("N49W123.v2_a-b"), "N49W123.v2_a-b");
  EXPECT_EQ(safe_name("a b/c\xe2\x82\xac"), "a_b_c_");
  EXPECT_EQ(safe_name("Z\xc3\xbcrich"), "Zurich");
  EXPECT_EQ(safe_name("Zu\xcc\x88rich"), "Zurich");  // as other systems write it
  EXPECT_EQ(safe_name("\xc3\x86r\xc3\xb8 \xc5\x81\xc3\xb3"
                      "d\xc5\xba"),
            "AEro_Lodz");
  EXPECT_EQ(safe_name("\xc3\x80\xc3\xbf\xc4\x80\xc5\xbf"), "AyAs");  // the table's ends
  EXPECT_EQ(safe_name("\xe6\x9d\xb1\xe4\xba\xac"), "dataset");
  EXPECT_EQ(safe_name("\xe6\x9d\xb1\xe4\xba\xac 2"), "___2");
  EXPECT_EQ(safe_name("cut\xc3"), "cut_");
  EXPECT_EQ(safe_name("_"), "_");
  EXPECT_EQ(safe_name(""), "dataset");
  EXPECT_EQ(safe_name(".."), "_.");
  EXPECT_EQ(safe_name(std::string(100, 'a')), std::string(64, 'a'));
}

}  // namespace
}  // namespace tind::services
