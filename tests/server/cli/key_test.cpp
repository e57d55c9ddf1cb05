#include <gtest/gtest.h>

#include <fstream>

#include "server/services/access/keys.h"
#include "server/services/datasets/config.h"
#include "tests/support/program_json.h"

namespace tind::cli {
namespace {

TEST(KeyCommand, MakesAKeyWhoseTableADaemonTakes) {
  const auto json = test::tind_json(
      "key new ann --scopes tiles,read --datasets alps --rate 20 --expires 2027-06-30 --json");
  const std::string secret = json["key"], table = json["toml"];
  EXPECT_EQ(table.find(secret), std::string::npos);
  const test::TempDir dir;
  const std::string file = dir.file("tind.toml");
  std::ofstream(file) << table;
  services::ConfigInput input;
  input.file = file;
  const auto config = services::read_config(input);
  ASSERT_TRUE(config) << config.error().what;
  ASSERT_EQ(config->access.keys.size(), 1u);
  const services::Key& key = config->access.keys[0];
  EXPECT_EQ(services::find_key(config->access.keys, secret), &key);
  EXPECT_EQ(key.datasets, std::vector<std::string>{"alps"});
  EXPECT_EQ(key.expires, services::time_of("2027-06-30"));
}

TEST(KeyCommand, SaysWhatIsWrong) {
  for (const char* const line :
       {"key", "key old ann --scopes read", "key new", "key new ann", "key new ann --scopes all",
        "key new 'a b' --scopes read", "key new ann --scopes read --burst 3",
        "key new ann --scopes read --expires soon"}) {
    const auto ran = test::run_tind(line);
    EXPECT_EQ(ran.code, 2) << line;
    EXPECT_EQ(ran.answer, "") << line;
    EXPECT_FALSE(ran.out.empty()) << line;
  }
}

}  // namespace
}  // namespace tind::cli
