#include "terrain/base/enum_names.h"

#include <gtest/gtest.h>

namespace tind {
namespace {

enum class Fruit { apple, crab_apple, pear };

}  // namespace

template <>
struct EnumNames<Fruit> {
  static constexpr const char* kWhat = "fruit";
  static constexpr std::pair<Fruit, const char*> kAll[] = {
      {Fruit::pear, "pear"}, {Fruit::apple, "apple"}, {Fruit::crab_apple, "crab-apple"}};
};

namespace {

TEST(EnumNames, EveryNameReadsAsTheValueThatPrintsIt) {
  for (const Fruit f : {Fruit::apple, Fruit::crab_apple, Fruit::pear}) {
    const Result<Fruit> read = parse_enum<Fruit>(name_of(f));
    ASSERT_TRUE(read);
    EXPECT_EQ(*read, f);
  }
  EXPECT_EQ(name_of(Fruit::crab_apple), "crab-apple");
}

TEST(EnumNames, AreOfferedInTheOrderOfTheTable) {
  EXPECT_EQ(enum_names<Fruit>(), (std::vector<std::string>{"pear", "apple", "crab-apple"}));
}

TEST(EnumNames, AnErrorNamesAllTheChoices) {
  for (const char* text : {"plum", "", "Pear", "pear "}) {
    const Result<Fruit> read = parse_enum<Fruit>(text);
    ASSERT_FALSE(read) << text;
    EXPECT_EQ(read.error().code, Errc::invalid_argument);
    EXPECT_EQ(read.error().what,
              "there is no fruit '" + std::string(text) + "': choose pear, apple or crab-apple");
    EXPECT_FALSE(enum_named<Fruit>(text));
  }
}

}  // namespace
}  // namespace tind
