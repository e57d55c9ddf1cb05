#include "terrain/simplify/method_text.h"

#include <gtest/gtest.h>

#include "terrain/simplify/methods.h"

namespace tind {
namespace {

TEST(MethodText, is_the_name_alone_where_all_is_by_default) {
  for (const MethodOptions& method : all_methods())
    EXPECT_EQ(method_text(method), method_name(method));
}

TEST(MethodText, has_every_option_that_is_not_and_reads_back_as_it_was) {
  EdgeCostOptions edge;
  edge.alpha = 0.1 + 0.2;  // not a short number
  edge.term = Term::height;
  QemOptions qem;
  qem.border_constraints = true;
  VertexRemovalOptions removal;
  removal.k = 7;
  for (const MethodOptions& method :
       {MethodOptions(edge), MethodOptions(qem), MethodOptions(removal)}) {
    const std::string text = method_text(method);
    EXPECT_NE(text, method_name(method));
    const auto back = method_from_text(text);
    ASSERT_TRUE(back) << text << ": " << back.error().what;
    EXPECT_EQ(method_text(*back), text);
  }
  EXPECT_EQ(std::get<EdgeCostOptions>(*method_from_text(method_text(edge))).alpha, edge.alpha);
  EXPECT_EQ(method_text(*method_from_text("  edge-cost   beta=3 alpha=1 ")),
            "edge-cost alpha=1 beta=3");
}

TEST(MethodText, refuses_what_makes_no_sense) {
  for (const char* text :
       {"", "quadric", "qem alpha=1", "edge-cost alpha", "edge-cost alpha=", "edge-cost alpha=x",
        "edge-cost alpha=1x", "edge-cost alpha=-1", "edge-cost alpha=nan", "qem subset-placement=1",
        "vertex-removal k=0", "vertex-removal k=99999999999", "edge-cost term=width", "greedy fast",
        "attribute-qem drape=a.png"}) {
    const auto method = method_from_text(text);
    ASSERT_FALSE(method) << text;
    EXPECT_EQ(method.error().code, Errc::invalid_argument) << text;
  }
}

}  // namespace
}  // namespace tind
