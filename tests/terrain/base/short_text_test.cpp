#include "terrain/base/short_text.h"

#include <gtest/gtest.h>

namespace tind {
namespace {

TEST(ShortText, EndsWithAWholeCharacter) {
  EXPECT_EQ(short_text("fjell", 9), "fjell");
  EXPECT_EQ(short_text("fjell", 5), "fjell");
  EXPECT_EQ(short_text("fjell", 3), "fje");
  const std::string_view peak = "h\u00f8yde\u26f0";  // letters of 1, 2 and 3 bytes
  EXPECT_EQ(short_text(peak, 2), "h");
  EXPECT_EQ(short_text(peak, 3), "h\u00f8");
  EXPECT_EQ(short_text(peak, 8), "h\u00f8yde");
  EXPECT_EQ(short_text(peak, 9), peak);
  EXPECT_EQ(short_text("\xbf\xbf", 1), "") << "no beginning of one";
}

}  // namespace
}  // namespace tind
