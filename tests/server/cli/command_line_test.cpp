// What the parser says of values that are none: one line that names the option and what it takes.

#include "server/cli/program/command_line.h"

#include <gtest/gtest.h>

#include "tests/support/program.h"

namespace tind {
namespace {

using test::run_tind;
using test::TempDir;
using test::testdata;

std::string parsed(const std::string& name, const std::string& value) {
  cli::Program program("p", "p 1");
  cli::Command command = program.root().add_subcommand("c", "c");
  std::optional<std::uint64_t> count;
  std::uint32_t small = 0;
  std::uint64_t memory = 0;
  double above = 1;
  std::optional<double> plain;
  std::vector<double> list;
  int whole = 0;
  command.add_option("--count", count, "");
  command.add_option("--small", small, "");
  command.add_option("--memory", memory, "").bytes();
  command.add_option("--above", above, "").positive();
  command.add_option("--plain", plain, "");
  command.add_option("--list", list, "").delimiter(',');
  command.add_option("--whole", whole, "").not_negative();
  const char* const argv[] = {"p", "c", name.c_str(), value.c_str()};
  const auto result = program.parse(4, argv);
  EXPECT_EQ(result.ran, result.errors.empty());
  return result.errors.substr(0, result.errors.find('\n'));
}

TEST(CommandLine, RefusesANegativeCount) {
  EXPECT_EQ(parsed("--count", "-5"), "tind: --count: must be 0 or more, not -5");
  EXPECT_EQ(parsed("--small", "-1"), "tind: --small: must be 0 or more, not -1");
  EXPECT_EQ(parsed("--memory", "-1"), "tind: --memory: must be 0 or more, not -1");
  EXPECT_EQ(parsed("--whole", "-3"), "tind: --whole: must be 0 or more, not -3");
  EXPECT_EQ(parsed("--count", "0"), "");
  EXPECT_EQ(parsed("--count", "18446744073709551615"), "");
  EXPECT_EQ(parsed("--memory", "2G"), "");
  EXPECT_EQ(parsed("--plain", "-5"), "");
  EXPECT_EQ(parsed("--list", "-5,1e3"), "");
}

TEST(CommandLine, SaysARangeInWords) {
  EXPECT_EQ(parsed("--above", "-1"), "tind: --above: must be above 0, not -1");
  EXPECT_EQ(parsed("--above", "0"), "tind: --above: must be above 0, not 0");
  EXPECT_EQ(parsed("--above", "0.5"), "");
}

TEST(CommandLine, TakesNoNumberThatIsNotFinite) {
  for (const std::string value : {"nan", "-nan", "inf", "-inf", "1e999", "NaN", "infinity"})
    for (const char* option : {"--above", "--plain", "--list"})
      EXPECT_NE(parsed(option, value), "") << option << " " << value;
  EXPECT_EQ(parsed("--above", "nan"), "tind: --above: must be a finite number, not nan");
  EXPECT_EQ(parsed("--plain", "inf"), "tind: --plain: must be a finite number, not inf");
  const std::string dem = testdata("rainier.tif");
  for (const std::string& line :  // what is in a range by comparison alone
       {"line-of-sight " + dem + " --from -121.9,46.9 --to -121.7,46.9 --refraction nan",
        "volume " + dem + " --height nan", "statistics " + dem + " --base inf"}) {
    const auto ran = run_tind(line);
    EXPECT_EQ(ran.code, 2) << line << ran.out;
    EXPECT_NE(ran.out.find("must be a finite number"), std::string::npos) << ran.out;
  }
}

TEST(CommandLine, SaysHowANumberIsWritten) {
  EXPECT_EQ(parsed("--plain", "10%"), "tind: --plain: '10%' is not a number; write 10% as 0.1");
  EXPECT_EQ(parsed("--plain", "much"), "tind: --plain: 'much' is not a number");
  EXPECT_EQ(parsed("--list", "1,x"), "tind: --list: 'x' is not a number");
  EXPECT_EQ(parsed("--count", "1.5"), "tind: --count: '1.5' is not a whole number, or too large");
}

TEST(CommandLine, NoCommandTakesANegativeCount) {
  const TempDir dir;
  const std::string dem = testdata("crater.tif"), out = " -o " + dir.file("a.ply");
  for (const std::string& line :
       {"simplify " + dem + " --triangles -5" + out, "extract a.tpm --triangles -1" + out,
        "simplify " + dem + " --ratio 1 --threads -3" + out}) {
    const test::Ran ran = run_tind(line);
    EXPECT_EQ(ran.code, 2) << line;
    EXPECT_NE(ran.out.find("must be 0 or more"), std::string::npos) << ran.out;
  }
}

}  // namespace
}  // namespace tind
