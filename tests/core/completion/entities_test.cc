#include "core/completion/entities.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;
using ::testing::SizeIs;

struct Scan {
  std::vector<LabelledPoint> points;
};

// A level square of `side_m`, a point every 4 cm.
void AddPatch(const Eigen::Vector3d& corner, double side_m, std::uint16_t label, Scan& scan) {
  for (double x = 0.0; x < side_m; x += 0.04) {
    for (double y = 0.0; y < side_m; y += 0.04) {
      scan.points.push_back({corner + Eigen::Vector3d(x, y, 0.0), label});
    }
  }
}

// The plan in squares of `side_m` around what the scans saw.
std::vector<Eigen::AlignedBox2d> SquaresOf(double side_m) {
  std::vector<Eigen::AlignedBox2d> squares;
  for (double x = -20.0; x < 20.0; x += side_m) {
    for (double y = -20.0; y < 20.0; y += side_m) {
      squares.emplace_back(Eigen::Vector2d(x, y), Eigen::Vector2d(x + side_m, y + side_m));
    }
  }
  return squares;
}

std::vector<FoundEntity> Find(const std::vector<Scan>& scans,
                              const std::vector<Eigen::AlignedBox2d>& squares,
                              const EntityOptions& options,
                              std::map<std::uint16_t, double>* reaches = nullptr) {
  EntityFinder finder(options);
  const auto fill = [&scans](SquareVoxels voxels) {
    for (std::size_t i = 0; i < scans.size(); ++i) {
      voxels.Add(scans[i].points, static_cast<std::uint32_t>(i));
    }
    return voxels;
  };
  for (const auto& square : squares) {
    STRATA_EXPECT_OK(finder.Measure(fill(finder.ForSpacing(square)), Stop()));
  }
  if (reaches != nullptr) *reaches = finder.Reaches();
  finder.Reaches();
  for (const auto& square : squares) {
    STRATA_EXPECT_OK(finder.Grow(fill(finder.ForGrowing(square)), Stop()));
  }
  auto found = finder.Finish(Stop());
  STRATA_EXPECT_OK(found);
  return found.ok() ? *std::move(found) : std::vector<FoundEntity>();
}

// What of entities does not depend on the squares, by place.
std::vector<std::vector<double>> Summary(const std::vector<FoundEntity>& entities) {
  std::vector<std::vector<double>> all;
  for (const FoundEntity& entity : entities) {
    std::vector<double> one = {static_cast<double>(entity.class_id),
                               static_cast<double>(entity.points),
                               static_cast<double>(entity.voxels.size())};
    for (const auto& seen : entity.scans) one.push_back(static_cast<double>(seen.points));
    all.push_back(one);
  }
  std::sort(all.begin(), all.end());
  return all;
}

// Single linkage over all pairs of points: the definition.
std::vector<std::size_t> SizesOfClusters(const std::vector<Eigen::Vector3d>& points, double d) {
  std::vector<std::size_t> cluster(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) cluster[i] = i;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if ((points[i] - points[j]).norm() > d || cluster[i] == cluster[j]) continue;
      const std::size_t from = cluster[i], to = cluster[j];
      std::replace(cluster.begin(), cluster.end(), from, to);
    }
  }
  std::map<std::size_t, std::size_t> sizes;
  for (const std::size_t c : cluster) ++sizes[c];
  std::vector<std::size_t> sorted;
  for (const auto& [c, size] : sizes) sorted.push_back(size);
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

TEST(EntitiesTest, WhatLiesTogetherIsOneAcrossBordersAndScans) {
  std::vector<Scan> scans(2);
  AddPatch({-1.0, -1.0, 0.0}, 2.0, 3, scans[0]);  // over the borders of four squares
  AddPatch({1.0, -1.0, 0.0}, 1.0, 3, scans[1]);   // goes on where the first ends
  AddPatch({3.0, 3.0, 0.0}, 1.0, 3, scans[1]);    // apart
  AddPatch({2.1, -1.0, 0.0}, 1.0, 5, scans[1]);   // next to it, but of another class
  std::map<std::uint16_t, double> reaches;
  const auto entities = Find(scans, SquaresOf(20.0), {}, &reaches);
  ASSERT_THAT(entities, SizeIs(3));
  EXPECT_NEAR(reaches.at(3), 3.0 * 0.05, 0.04);
  EXPECT_EQ(entities[0].class_id, 3);
  ASSERT_THAT(entities[0].scans, SizeIs(2));
  EXPECT_EQ(entities[0].points, scans[0].points.size() + 625U);
  EXPECT_NEAR(entities[0].box.size.x(), 3.0, 0.1);
  EXPECT_NEAR(entities[0].box.size.y(), 2.0, 0.1);
  EXPECT_LT((entities[1].box.centre - Eigen::Vector3d(3.48, 3.48, 0.0)).norm(), 0.05);
  EXPECT_EQ(entities[2].class_id, 5);
}

TEST(EntitiesTest, SquaresOfAnySizeAndOrderFindTheSame) {
  const unsigned seed = 7;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-18.0, 18.0);
  std::uniform_real_distribution<double> spread(-0.6, 0.6);
  std::vector<Scan> scans(4);
  for (int blob = 0; blob < 250; ++blob) {
    const double x = place(random);
    const double y = place(random);
    for (int i = 0; i < 30; ++i) {
      const double dx = spread(random);
      const double dy = spread(random);
      const double dz = spread(random);
      const std::uint16_t label = blob % 2 == 0 ? 1 : 2;
      scans[static_cast<std::size_t>(i % 4)].points.push_back({{x + dx, y + dy, dz}, label});
    }
  }
  const EntityOptions options{.distance_m = 0.4, .voxel_m = 0.05, .min_points = 10};
  const auto whole = Find(scans, SquaresOf(40.0), options);
  EXPECT_GT(whole.size(), 50U);
  auto small = SquaresOf(4.0);
  EXPECT_EQ(Summary(Find(scans, small, options)), Summary(whole));
  std::reverse(small.begin(), small.end());
  EXPECT_EQ(Summary(Find(scans, small, options)), Summary(whole));
  EXPECT_EQ(Summary(Find(scans, SquaresOf(10.0), options)), Summary(whole));
}

TEST(EntitiesTest, AgreesWithSingleLinkage) {
  const unsigned seed = 11;
  SCOPED_TRACE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-4.0, 4.0);
  std::vector<Scan> scans(1);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 600; ++i) {
    const double x = place(random);
    const double y = place(random);
    const double z = place(random) / 8.0;
    points.emplace_back(x, y, z);
    scans[0].points.push_back({points.back(), 9});
  }
  const EntityOptions options{.distance_m = 0.35, .voxel_m = 0.01, .min_points = 1};
  std::vector<std::size_t> sizes;
  for (const FoundEntity& entity : Find(scans, SquaresOf(2.0), options)) {
    sizes.push_back(entity.points);
  }
  std::sort(sizes.begin(), sizes.end());
  EXPECT_EQ(sizes, SizesOfClusters(points, 0.35));
}

TEST(EntitiesTest, FewPointsAreNone) {
  std::vector<Scan> scans(1);
  AddPatch({0.0, 0.0, 0.0}, 0.2, 1, scans[0]);
  EXPECT_THAT(Find(scans, SquaresOf(20.0), {}), SizeIs(0));
  EXPECT_THAT(Find(scans, SquaresOf(20.0), {.min_points = 25}), SizeIs(1));
  scans[0].points.push_back({{1e300, 0.0, 0.0}, 1});
  scans[0].points.push_back({{0.0, 0.0, 0.0}, 0});
  EXPECT_THAT(Find(scans, SquaresOf(20.0), {.min_points = 26}), SizeIs(0));
}

TEST(EntitiesTest, OptionsOutOfRangeAreNamed) {
  EXPECT_THAT(EntityOptions({.distance_m = 5.0, .voxel_m = 0.0, .min_points = 0}).Validate(),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("voxel_m")));
  STRATA_EXPECT_OK(EntityOptions().Validate());
}

}  // namespace
}  // namespace strata
