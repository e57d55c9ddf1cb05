// The scheme of buckets, against numbers that FlightGear's own programs print.

#include "terrain/flightgear/bucket_id.h"

#include <gtest/gtest.h>

#include <set>

namespace tind::flightgear {
namespace {

TEST(BucketId, HasTheNumbersOfFlightGear) {
  struct Known {
    Geographic place;
    std::uint32_t index;
    const char* path;
  };
  // As SGBucket(SGGeod::fromDeg(lon, lat)) of SimGear 2020.3 has them.
  for (const Known& k : {
           Known{{6.75, 45.83}, 3056115, "e000n40/e006n45"},
           Known{{-121.76, 46.85}, 959024, "w130n40/w122n46"},
           Known{{0, 0}, 2954880, "e000n00/e000n00"},
           Known{{-0.001, -0.001}, 2938495, "w010s10/w001s01"},
           Known{{179.99, 21.9}, 5889023, "e170n20/e179n21"},
           Known{{-180, 22}, 7168, "w180n20/w180n22"},
           Known{{12.3, 62.1}, 3155456, "e010n60/e012n62"},
           Known{{-12.3, -62.1}, 2737913, "w020s70/w013s63"},
           Known{{-0.5, 76.5}, 2943392, "w010n70/w001n76"},
           Known{{13.5, 83.5}, 3156832, "e010n80/e012n83"},
           Known{{-13.5, -84}, 2720128, "w020s90/w014s84"},
           Known{{7, 87}, 3025984, "e000n80/e004n87"},
           Known{{-7, -87.9}, 2818176, "w010s90/w008s88"},
           Known{{35, 89.5}, 3353824, "e020n80/e024n89"},
           Known{{-35, -89.5}, 2359328, "w040s90/w036s90"},
           Known{{100.01, -22}, 4591872, "e100s30/e100s22"},
           Known{{100.01, -22.01}, 4591864, "e100s30/e100s23"},
           Known{{8.4375, -89}, 3080256, "e000s90/e008s89"},
           Known{{-179.99, -90}, 0, "w180s90/w180s90"},
       }) {
    const BucketId id = bucket_at(k.place);
    EXPECT_EQ(index_of(id), k.index) << k.place.lon << " " << k.place.lat;
    EXPECT_EQ(path_of(folder_of(id)), k.path);
    EXPECT_TRUE(rect(id).contains(k.place));
  }
}

TEST(BucketId, EveryBucketComesBackFromItsNumber) {
  std::set<std::uint32_t> seen;
  for (int row = 0; row < kRows; ++row) {
    ASSERT_EQ(2880 % width_of_row(row), 0);
    for (int x = 0; x < 2880; x += width_of_row(row)) {
      const BucketId id{row, x};
      ASSERT_TRUE(seen.insert(index_of(id)).second);
      ASSERT_EQ(bucket_of(index_of(id)), id);
    }
  }
  std::size_t there = 0;
  for (std::int64_t index = -5; index < (std::int64_t(361) << 14); ++index)
    there += bucket_of(index).has_value();
  EXPECT_EQ(there, seen.size());
}

TEST(BucketId, WidthsChangeWhereFlightGearsDo) {
  for (const auto& [lat, below, above] :
       {std::tuple{22.0, 1, 2}, std::tuple{62.0, 2, 4}, std::tuple{76.0, 4, 8},
        std::tuple{83.0, 8, 16}, std::tuple{86.0, 16, 32}, std::tuple{89.0, 32, 96}}) {
    const int north = int((lat + 90) * 8), south = int((-lat + 90) * 8);
    EXPECT_EQ(width_of_row(north - 1), below);
    EXPECT_EQ(width_of_row(north), above);
    EXPECT_EQ(width_of_row(south), below);
    EXPECT_EQ(width_of_row(south - 1), above);
  }
}

TEST(BucketId, FoldersHoldEachBucketOnce) {
  std::set<BucketId> seen;
  for (int lat = -90; lat < 90; ++lat)
    for (int lon = -180; lon < 180; ++lon) {
      const Folder f{lon, lat};
      for (const BucketId id : buckets_in(f)) {
        EXPECT_TRUE(folder_of(id) == f);
        EXPECT_TRUE(seen.insert(id).second);
      }
      const std::string path = path_of(f);
      const std::size_t slash = path.find('/');
      EXPECT_TRUE(folder_named(path.substr(0, slash), path.substr(slash + 1)) == f) << path;
    }
  std::size_t all = 0;
  for (int row = 0; row < kRows; ++row) all += std::size_t(2880 / width_of_row(row));
  EXPECT_EQ(seen.size(), all);
}

TEST(BucketId, OtherNamesAreNoFolders) {
  EXPECT_TRUE(folder_named("w130n40", "w123n45"));
  for (const auto& [ten, one] :
       {std::pair{"w120n40", "w123n45"}, std::pair{"w130n40", "w123n4"}, std::pair{"", ""},
        std::pair{"w130n40", "W123n45"}, std::pair{"w130n40", "w1-3n45"},
        std::pair{"e000n00", "w000n00"}, std::pair{"e180n40", "e180n40"},
        std::pair{"e000n90", "e000n90"}, std::pair{"w130n40", "w123n45/"}})
    EXPECT_FALSE(folder_named(ten, one)) << ten << " " << one;
}

}  // namespace
}  // namespace tind::flightgear
