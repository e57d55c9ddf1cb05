// A raster cut into pieces: the windows hold what H takes, none is larger than it may be, and how
// it is cut shows in no height.

#include "terrain/heightmaps/lattice_pieces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <random>

#include "terrain/geo/longitude.h"
#include "terrain/surface/height_field.h"
#include "tests/support/made_up_source.h"
#include "tests/support/text_dem.h"
#include "tests/support/vast_source.h"

namespace tind {
namespace {

using test::MadeUpSource;
using test::VastSource;

/// Cells of these many degrees, the first one's north-western corner here.
RasterLattice cells(Geographic corner, Vec2 step, int cols, int rows) {
  const double metres = 111320, across = metres * std::cos(corner.lat * std::numbers::pi / 180);
  return {cols,
          rows,
          {step.x * across, step.y * metres},
          [=](double row, double first, std::span<Geographic> places) {
            for (std::size_t i = 0; i < places.size(); ++i)
              places[i] = {corner.lon + (first + double(i) + .5) * step.x,
                           corner.lat - (row + .5) * step.y};
          }};
}

/// Squares of these many metres around the north pole, which is in the middle.
RasterLattice cells_of_pole(double side_m, int cols, int rows) {
  return {
      cols, rows, {side_m, side_m}, [=](double row, double first, std::span<Geographic> places) {
        for (std::size_t i = 0; i < places.size(); ++i) {
          const double x = (first + double(i) - (cols - 1) / 2.) * side_m,
                       y = ((rows - 1) / 2. - row) * side_m;
          places[i] = {std::atan2(x, -y) * 180 / std::numbers::pi, 90 - std::hypot(x, y) / 111320};
        }
      }};
}

/// Anywhere in the piece's cells.
std::vector<Geographic> places_in(const RasterLattice& lattice, const LatticePiece& piece,
                                  std::mt19937& random) {
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<Geographic> places(200);
  for (Geographic& p : places) {
    lattice.places(piece.row - .5 + share(random) * piece.rows,
                   piece.col - .5 + share(random) * piece.cols, {&p, 1});
    p = within_first_turn(p);
  }
  return places;
}

Result<void> load(HeightField& field, std::span<const LayerPosts> under) {
  for (const LayerPosts& p : under)
    if (auto done = field.load(p.layer, p.col, p.row, int(p.cols), int(p.rows)); !done) return done;
  return {};
}

TEST(LatticePieces, WhatLiesUnderAPieceHasAllThatHTakes) {
  std::mt19937 random(5);
  for (const double turn : {0.0, .3, 1.4, 3.0}) {
    const MadeUpSource source(test::rough_terrain(160, 140, 3), {7, 46}, .001, turn);
    const GeoRect& b = source.info().bounds;
    const double step = .0023;
    const auto lattice = cells({b.west - .0098, b.north + .0098}, {step, step},
                               int((b.width() + .02) / step), int((b.height() + .02) / step));
    for (int i = 0; i < 60; ++i) {
      LatticePiece piece;
      piece.cols = 2 + int(random() % 20), piece.rows = 2 + int(random() % 20);
      piece.col = int(random() % unsigned(lattice.cols - piece.cols));
      piece.row = int(random() % unsigned(lattice.rows - piece.rows));
      HeightField field{Surface(source)};
      ASSERT_TRUE(load(field, posts_under(Surface(source), lattice, piece)));
      const auto places = places_in(lattice, piece, random);
      std::vector<double> heights(places.size());
      source.reads_left = 0;
      field.at(places, heights);
      source.reads_left = std::numeric_limits<std::int64_t>::max();
      ASSERT_FALSE(field.error()) << turn << ": " << piece.col << ' ' << piece.row << ' '
                                  << piece.cols << ' ' << piece.rows;
    }
  }
}

TEST(LatticePieces, AcrossTheAntimeridianThereAreFewPosts) {
  const auto around = std::make_shared<VastSource>(3600, 1799, Geographic{-180, 89.9}, .1),
             east_of_it = std::make_shared<VastSource>(200, 1799, Geographic{170, 89.9}, .1);
  std::mt19937 random(6);
  for (const auto& source : {around, east_of_it}) {
    const auto lattice = cells({178, 5}, {.05, .05}, 80, 40);
    for (const int half : {0, 1}) {  // from the west to 181, and on the other side only
      const LatticePiece piece{20 + 30 * half, 5, 20 + 10 * (1 - half) * 2, 30};
      const auto under = posts_under(Surface(source), lattice, piece);
      ASSERT_EQ(under.size(), 1u);
      EXPECT_LE(under[0].count(), 40 * 30);
      HeightField field{Surface(source)};
      ASSERT_TRUE(load(field, under));
      const std::int64_t before = source->reads;
      const auto places = places_in(lattice, piece, random);
      std::vector<double> heights(places.size());
      field.at(places, heights);
      EXPECT_EQ(source->reads, before);
      for (const double h : heights) EXPECT_FALSE(std::isnan(h));
    }
  }
}

TEST(LatticePieces, AroundAPoleIsAllOfALayerAndBesideItAFew) {
  const auto cap = std::make_shared<VastSource>(3600, 300, Geographic{-180, 89.95}, .1);
  const auto lattice = cells_of_pole(11132, 20, 20);
  const auto around = posts_under(Surface(cap), lattice, {8, 8, 4, 4}),
             beside = posts_under(Surface(cap), lattice, {12, 9, 4, 2});
  ASSERT_TRUE(around.size() == 1 && beside.size() == 1);
  EXPECT_EQ(around[0].count(), 3602 * 302);
  EXPECT_LT(beside[0].count(), 3600 * 20);
  const auto elsewhere = std::make_shared<VastSource>(100, 100, Geographic{7, 46}, .1);
  EXPECT_TRUE(posts_under(Surface(elsewhere), lattice, {12, 9, 4, 2}).empty());
}

TEST(LatticePieces, AreEveryCellOnceAndWithinTheirLimits) {
  const auto source = std::make_shared<VastSource>(4000, 3000, Geographic{7, 46}, .001);
  const auto lattice = cells({7, 46}, {.03, .11}, 130, 27);
  for (const std::int64_t most : {1, 5000, 100'000, 50'000'000}) {
    std::vector<int> seen(130 * 27);
    const auto take = [&](const LatticePiece& p,
                          std::span<const LayerPosts> under) -> Result<void> {
      for (int r = p.row; r < p.row + p.rows; ++r)
        for (int c = p.col; c < p.col + p.cols; ++c) ++seen[std::size_t(r * 130 + c)];
      EXPECT_LE(p.cols, 50);
      for (const LayerPosts& posts : under)
        EXPECT_TRUE(posts.count() <= most || p.cols * p.rows == 1) << posts.count();
      return {};
    };
    ASSERT_TRUE(cut_piece(Surface(source), lattice, {0, 0, 130, 27}, {most, 50}, take));
    EXPECT_TRUE(std::ranges::all_of(seen, [](int n) { return n == 1; })) << most;
  }
  int taken = 0;
  const auto refuse = [&](const LatticePiece&, std::span<const LayerPosts>) -> Result<void> {
    return ++taken, fail(Errc::io, "enough");
  };
  EXPECT_FALSE(cut_piece(Surface(source), lattice, {0, 0, 130, 27}, {5000, 50}, refuse));
  EXPECT_EQ(taken, 1);
}

/// The same to the last bit.
void expect_same(const LatticeHeights& a, const LatticeHeights& b) {
  ASSERT_EQ(a.heights.size(), b.heights.size());
  EXPECT_EQ(std::memcmp(a.heights.data(), b.heights.data(), a.heights.size() * sizeof(float)), 0);
  EXPECT_EQ(a.samples, b.samples);
  EXPECT_EQ(a.max_deviation_m, b.max_deviation_m);
  EXPECT_EQ(a.without_height, b.without_height);
}

void expect_same_in_all_pieces(const Surface& surface, const RasterLattice& lattice,
                               bool fill = false) {
  const auto whole = lattice_heights(surface, lattice, {.fill = fill, .threads = 1});
  ASSERT_TRUE(whole) << whole.error().what;
  EXPECT_LT(whole->without_height, whole->heights.size());
  for (const std::int64_t most : {1, 60, 900}) {
    const auto cut =
        lattice_heights(surface, lattice, {.fill = fill, .threads = 3, .most_held = most});
    ASSERT_TRUE(cut) << cut.error().what;
    expect_same(*cut, *whole);
  }
}

TEST(LatticePieces, HowTheyAreCutShowsInNoHeight) {
  for (const double turn : {0.0, .4}) {
    const MadeUpSource source(test::terrain_with_voids(60, 50, 5), {7, 46}, .001, turn);
    const GeoRect& b = source.info().bounds;
    for (const Vec2 step :
         {Vec2{.0007, .0007}, Vec2{.001, .001}, Vec2{.0023, .0041}, Vec2{.0113, .0019}})
      expect_same_in_all_pieces(
          source, cells({b.west - .004, b.north + .003}, step, int((b.width() + .008) / step.x) + 1,
                        int((b.height() + .006) / step.y) + 1));
    expect_same_in_all_pieces(source, cells({b.west, b.north}, {.0031, .0027}, 25, 22), true);
  }
}

TEST(LatticePieces, NorOfLayersThatAreBentToEachOther) {
  const test::TempDir folder;
  const auto surface = Surface::of_layers(
      {{"low", test::text_dem(folder, "low", test::rough_terrain(60, 50, 3), {7, 46}, .004)},
       {"high",
        test::text_dem(folder, "high", test::terrain_with_voids(80, 70, 4), {7.08, 46.06}, .001)}});
  ASSERT_TRUE(surface) << surface.error().what;
  expect_same_in_all_pieces(*surface, cells({7.05, 46.15}, {.0021, .0017}, 70, 60));
}

TEST(LatticePieces, NorAcrossTheAntimeridian) {
  const auto source = std::make_shared<VastSource>(3600, 1799, Geographic{-180, 89.9}, .1);
  expect_same_in_all_pieces(source, cells({178, 5}, {.23, .4}, 20, 12));
  expect_same_in_all_pieces(source, cells({-180, 90}, {9, 9}, 40, 20));
}

TEST(LatticePieces, NoWindowIsLargerThanSixteenMillionPosts) {
  const auto source = std::make_shared<VastSource>(8000, 4000, Geographic{7, 46}, .0005);
  const auto lattice = cells({7, 46}, {.001, .0625}, 4000, 32);  // 2 x 125 posts each
  const auto made = lattice_heights(Surface(source), lattice, {.threads = 1});
  ASSERT_TRUE(made) << made.error().what;
  EXPECT_EQ(made->samples, 16);
  EXPECT_LE(source->largest_read, 1 << 24);
  EXPECT_LT(source->reads, 100) << "where samples are dense, they are not read one by one";
}

TEST(LatticePieces, ManyThreadsHoldNoMoreEachThanTheyMay) {
  const auto source = std::make_shared<VastSource>(3000, 2000, Geographic{7, 46}, .001);
  const auto lattice = cells({7, 46}, {.004, .004}, 750, 500);
  ASSERT_TRUE(lattice_heights(Surface(source), lattice, {.threads = 3, .most_held = 40'000}));
  EXPECT_LE(source->largest_read, 40'000);
  EXPECT_LT(source->reads, 1000);
}

TEST(LatticePieces, SaysBeforeItReadsWhetherThatIsTooMuch) {
  const double most = 1 << 29;
  const auto vast = std::make_shared<VastSource>(40'000, 40'000, Geographic{7, 46}, .0001);
  const Surface surface(vast);
  const auto window = [](double side, int pixels) {
    return cells({7, 46}, {side / pixels, side / pixels}, pixels, pixels);
  };
  EXPECT_TRUE(takes_more_posts(surface, window(4, 64), most));
  EXPECT_TRUE(takes_more_posts(surface, window(4, 1024), most));
  EXPECT_TRUE(takes_more_posts(surface, window(3, 2048), most));
  EXPECT_FALSE(takes_more_posts(surface, window(2, 1024), most));
  EXPECT_FALSE(takes_more_posts(surface, window(.1, 2048), most));
  EXPECT_FALSE(takes_more_posts(surface, window(4, 2), most)) << "256 places, a block each";
  const auto wide = cells({7, 46}, {4 / 16384., 4 / 256.}, 16384, 256);
  EXPECT_TRUE(takes_more_posts(surface, wide, most));
  EXPECT_EQ(vast->reads, 0);
  const auto large = std::make_shared<VastSource>(20'000, 16'000, Geographic{7, 46}, .0001);
  EXPECT_FALSE(takes_more_posts(Surface(large), wide, most)) << "it has no more";
}

TEST(LatticePieces, CountsWhatLiesAcrossTheAntimeridianOnce) {
  const auto globe =
      std::make_shared<VastSource>(86'400, 43'199, Geographic{-180, 90 - 1 / 240.}, 1 / 240.);
  const auto lattice = cells({178, 60}, {4 / 256., 120 / 7680.}, 256, 7680);  // 27.6 million posts
  EXPECT_FALSE(takes_more_posts(Surface(globe), lattice, 60e6));
  EXPECT_TRUE(takes_more_posts(Surface(globe), lattice, 20e6));
}

TEST(LatticePieces, AReadErrorAndAStopEndIt) {
  const MadeUpSource source(test::rough_terrain(160, 140, 3), {7, 46}, .001);
  const auto lattice = cells({7, 46}, {.002, .002}, 70, 60);
  source.reads_left = 5;
  const auto broken = lattice_heights(source, lattice, {.threads = 2, .most_held = 500});
  ASSERT_FALSE(broken);
  EXPECT_EQ(broken.error().code, Errc::io);
  source.reads_left = std::numeric_limits<std::int64_t>::max();
  std::stop_source stop;
  stop.request_stop();
  const auto stopped =
      lattice_heights(source, lattice, {}, {.report = {}, .stop = stop.get_token()});
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, Errc::cancelled);
}

}  // namespace
}  // namespace tind
