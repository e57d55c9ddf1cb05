// Coverages of a DEM that is larger than one answer may read.

#include "tests/server/api/ogc/ogc_fixture.h"
#include "tests/support/vast_source.h"

namespace tind::api {
namespace {

class VastCoverages : public Ogc {
 protected:
  /// 1.6e9 posts.
  void SetUp() override { catalog_.add("vast", dataset_of(Surface(vast_))); }

  std::shared_ptr<test::VastSource> vast_ =
      std::make_shared<test::VastSource>(40'000, 40'000, Geographic{7, 46}, .0001);
};

TEST_F(VastCoverages, ThatTakeTooManyPostsAreRefusedUnread) {
  for (const char* query : {"?width=64&height=64", "?width=16384&height=256",
                            "?width=256&bbox=7,43,10,46", "?width=256&bbox=7,43,10,46&f=asc"})
    expect_wrong(std::string("/collections/vast/coverage") + query, "bbox");
  EXPECT_EQ(vast_->reads, 0);
}

TEST_F(VastCoverages, OfAPartAreReadInWindowsOfABoundedSize) {
  const HttpReply reply =
      get("/collections/vast/coverage?bbox=8,44,8.5,44.5&width=4096&height=32");  // 25e6 posts
  EXPECT_EQ(reply.status, 200) << reply.body;
  EXPECT_GT(vast_->largest_read, 1 << 20);
  EXPECT_LE(vast_->largest_read, 1 << 24);
}

TEST_F(VastCoverages, OfFewPixelsReadBlocksHereAndThere) {
  const HttpReply reply = get("/collections/vast/coverage?width=2&height=2&f=covjson");
  EXPECT_EQ(reply.status, 200) << reply.body;
  EXPECT_EQ(Json::parse(reply.body)["ranges"]["height"]["values"].size(), 4u);
  EXPECT_LE(vast_->largest_read, 4);
}

}  // namespace
}  // namespace tind::api
