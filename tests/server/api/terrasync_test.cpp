// /terrasync: the index of a degree, the files that it names, and what is none.

#include <gtest/gtest.h>

#include "terrain/base/sha1.h"
#include "terrain/flightgear/bucket.h"
#include "tests/server/api/api_fixture.h"

namespace tind::api {
namespace {

TEST_F(Api, TheWayFromADegreesIndexToABucket) {
  add_dem();
  const std::string folder = "/terrasync/rainier/Terrain/w130n40/w122n46/";
  const HttpReply index = get(folder + ".dirindex");
  ASSERT_EQ(index.status, 200) << index.body;
  EXPECT_EQ(index.body.substr(0, 10), "version:1\n");
  std::istringstream lines(index.body);
  std::string line;
  int files = 0;
  while (std::getline(lines, line)) {
    if (!line.starts_with("f:")) continue;
    const std::size_t sum = line.find(':', 2), bytes = line.rfind(':');
    const HttpReply file = get(folder + line.substr(2, sum - 2));
    ASSERT_EQ(file.status, 200) << line;
    EXPECT_EQ(sha1(file.body), line.substr(sum + 1, 40)) << line;
    EXPECT_EQ(std::to_string(file.body.size()), line.substr(bytes + 1));
    EXPECT_EQ(file.headers.count("content-encoding"), 0u);  // gzip is the file's own
    ++files;
  }
  EXPECT_GT(files, 10);
}

TEST_F(Api, WhatIsNoPartOfSceneryIsNotFound) {
  add_dem();
  const std::string root = "/terrasync/rainier/", folder = root + "Terrain/w130n40/w122n46/";
  EXPECT_EQ(get(folder + "959024.stg").status, 200);
  for (const std::string& path :
       {std::string("/terrasync/nothing/Terrain/w130n40/w122n46/959024.stg"),
        std::string("/terrasync/made-up/Terrain/w130n40/w122n46/959024.stg"),  // it has no DEM
        root + "Terrain/w130n40/w121n46/959024.stg", root + "Terrain/w120n40/w122n46/959024.stg",
        folder + "0959024.stg", folder + "+959024.stg", folder + "-1.stg", folder + "959024.btg",
        folder + "99999999999999999999.stg", folder + "x.stg",
        root + "Terrain/e000n00/e000n00/.dirindex", root + "Terrain/w130n40/../.dirindex"})
    EXPECT_EQ(get(path).status, 404) << path;
  const HttpReply reply = get(root + ".dirindex");
  EXPECT_EQ(reply.status, 404);
  EXPECT_NE(reply.body.find("tind build"), std::string::npos) << reply.body;
  EXPECT_EQ(get(root + "Terrain/w130n40/.dirindex").status, 404);
}

}  // namespace
}  // namespace tind::api
