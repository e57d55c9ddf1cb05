#include "terrain/base/caught.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace tind {
namespace {

TEST(Caught, memory_may_be_there_again_and_a_mistake_stays_one) {
  EXPECT_EQ(caught(std::bad_alloc()).code, Errc::busy);
  EXPECT_TRUE(caught(std::bad_alloc()).what.starts_with(kNoMemory));
  EXPECT_EQ(caught(std::logic_error("why")).code, Errc::internal);
  EXPECT_EQ(caught(std::logic_error("why")).what, "why");
}

}  // namespace
}  // namespace tind
