#include "core/registration/column_grid.h"

#include <algorithm>
#include <cstdint>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata {
namespace {

std::vector<Eigen::Vector3f> RandomPoints(int n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> xy(-20.0F, 20.0F);
  std::uniform_real_distribution<float> z(-1.0F, 8.0F);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < n; ++i) {
    // Half of them in one tall column, which is searched by height.
    points.emplace_back(i % 2 == 0 ? xy(random) : 3.1F, i % 2 == 0 ? xy(random) : 4.2F, z(random));
  }
  return points;
}

TEST(ColumnGridTest, NearestEqualsBruteForce) {
  const ColumnGrid grid(RandomPoints(2000, 1), 0.4F);
  for (const Eigen::Vector3f& p : RandomPoints(500, 2)) {
    for (const float reach : {0.3F, 2.0F, 100.0F}) {
      float best = reach * reach;
      for (const Eigen::Vector3f& q : grid.points()) best = std::min(best, (p - q).squaredNorm());
      const std::uint32_t found = grid.Nearest(p, reach);
      const float got =
          found == ColumnGrid::kNone ? reach * reach : (grid.points()[found] - p).squaredNorm();
      EXPECT_EQ(got, best) << p.transpose() << " reach " << reach;
    }
  }
}

TEST(ColumnGridTest, NearestFewEqualBruteForce) {
  const ColumnGrid grid(RandomPoints(2000, 3), 0.4F);
  for (const Eigen::Vector3f& p : RandomPoints(200, 4)) {
    std::vector<float> all;
    for (const Eigen::Vector3f& q : grid.points()) {
      if ((p - q).squaredNorm() < 4.0F) all.push_back((p - q).squaredNorm());
    }
    std::sort(all.begin(), all.end());
    all.resize(std::min<std::size_t>(all.size(), 20));
    std::uint32_t indices[ColumnGrid::kMaxNeighbours];
    const int n = grid.Nearest(p, 20, 2.0F, indices);
    std::vector<float> got;
    for (int i = 0; i < n; ++i) got.push_back((grid.points()[indices[i]] - p).squaredNorm());
    std::sort(got.begin(), got.end());
    EXPECT_EQ(got, all);
  }
}

TEST(ColumnGridTest, AnswersHoldWithinTheirSlack) {
  const ColumnGrid grid(RandomPoints(2000, 5), 0.4F);
  std::mt19937_64 random(6);
  std::uniform_real_distribution<float> turn(-1.0F, 1.0F);
  int slack_left = 0;
  for (const Eigen::Vector3f& p : RandomPoints(500, 7)) {
    for (const float reach : {0.3F, 2.0F}) {
      const std::uint32_t hint = random() % 2000;
      const auto match = grid.NearestWithSlack(p, reach, 0.1F, hint);
      EXPECT_EQ(match.index, grid.NearestWithSlack(p, reach, 0.1F, ColumnGrid::kNone).index);
      ASSERT_GE(match.slack_m, -1e-5F);
      ASSERT_LE(match.slack_m, 0.1F + 1e-5F);
      slack_left += static_cast<int>(match.slack_m > 0.01F);
      const Eigen::Vector3f direction =
          Eigen::Vector3f(turn(random), turn(random), turn(random)).normalized();
      const Eigen::Vector3f q = p + std::max(match.slack_m - 1e-4F, 0.0F) * direction;
      const std::uint32_t nearest = grid.Nearest(q, reach);
      if (nearest == ColumnGrid::kNone) {
        EXPECT_TRUE(match.index == ColumnGrid::kNone ||
                    (grid.points()[match.index] - q).norm() >= reach);
      } else {
        EXPECT_EQ(nearest, match.index) << q.transpose() << " reach " << reach;
      }
    }
  }
  EXPECT_GT(slack_left, 100);
}

// Whatever the hint, and where many are equally near, too.
TEST(ColumnGridTest, HintsDoNotShow) {
  std::vector<Eigen::Vector3f> corners;
  for (int i = 0; i < 1000; ++i) {
    corners.emplace_back(
        static_cast<float>(i % 10), static_cast<float>(i / 10 % 10), static_cast<float>(i / 100));
  }
  const ColumnGrid equal(corners, 0.4F);
  const ColumnGrid drawn(RandomPoints(2000, 8), 0.4F);
  std::mt19937_64 random(9);
  for (const ColumnGrid* grid : {&equal, &drawn}) {
    for (int i = 0; i < 500; ++i) {
      const std::uint32_t hint = random() % grid->points().size();
      const Eigen::Vector3f& near = grid->points()[random() % grid->points().size()];
      const Eigen::Vector3f p = near + Eigen::Vector3f(0.5F, 0.5F, 0.5F);
      for (const float reach : {0.3F, 2.0F}) {
        EXPECT_EQ(grid->Nearest(p, reach, hint), grid->Nearest(p, reach));
      }
    }
  }
}

TEST(ColumnGridTest, OutsideOfTheGridIsSearchedToo) {
  const std::vector<Eigen::Vector3f> points = {{0, 0, 0}, {1, 0, 0}};
  const ColumnGrid grid(points, 0.4F);
  EXPECT_EQ(grid.Nearest({2.5F, 0, 0}, 2.0F), 1U);
  EXPECT_EQ(grid.Nearest({-1.0F, -1.0F, 0}, 2.0F), 0U);
  EXPECT_EQ(grid.Nearest({50, 0, 0}, 2.0F), ColumnGrid::kNone);
}

TEST(ColumnGridTest, EmptyGridHasNoNeighbours) {
  const ColumnGrid grid({}, 0.4F);
  std::uint32_t index = 0;
  EXPECT_EQ(grid.Nearest({0, 0, 0}, 1.0F), ColumnGrid::kNone);
  EXPECT_EQ(grid.Nearest({0, 0, 0}, 1, 1.0F, &index), 0);
}

TEST(ColumnGridTest, VastExtentWidensTheColumns) {
  const std::vector<Eigen::Vector3f> points = {{-900000, -900000, 0}, {900000, 900000, 5}};
  const ColumnGrid grid(points, 0.4F);
  EXPECT_LT(grid.memory_bytes(), 64U << 20);
  EXPECT_NE(grid.Nearest({900000, 900000, 4}, 2.0F), ColumnGrid::kNone);
}

}  // namespace
}  // namespace strata
