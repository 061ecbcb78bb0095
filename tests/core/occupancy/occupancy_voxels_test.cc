// What is known of voxels: eq. 4.10 in floating point, OctoMap's insertion, entropies.
#include "core/occupancy/occupancy_voxels.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include "core/cloud/point_cloud.h"
#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/occupancy/information.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

double Logit(double p) { return std::log(p / (1.0 - p)); }

TEST(InformationTest, EntropyIsOneWhereNothingIsKnown) {
  EXPECT_EQ(EntropyBits(0.5), 1.0);
  EXPECT_EQ(EntropyBits(0.0), 0.0);
  EXPECT_EQ(EntropyBits(1.0), 0.0);
  EXPECT_NEAR(EntropyBits(0.25), 2.0 - 0.75 * std::log2(3.0), 1e-12);
  EXPECT_NEAR(EntropyBits(0.1), EntropyBits(0.9), 1e-12);
  EXPECT_GT(InformationGainBits(0.5, 0.9), 0.0);
  EXPECT_LT(InformationGainBits(0.9, 0.6), 0.0);
}

// Scans that end in a voxel or go through it, as drawn, in eq. 4.10 with clamps.
TEST(OccupancyVoxelsTest, OddsAddUpAsTheThesisSays) {
  for (const InverseSensorModel& model :
       {InverseSensorModel(), InverseSensorModel{.miss = 0.1192}, InverseSensorModel{.hit = 0.9}}) {
    std::mt19937 random(3);
    OccupancyVoxelsOptions options;
    options.model = model;
    STRATA_ASSERT_OK(options.Validate());
    OccupancyVoxels grid(options);
    double odds = 0.0;
    for (int scan = 0; scan < 200; ++scan) {
      const bool hit = random() % 3 == 0;
      PointCloud cloud;
      cloud.points = {{hit ? 1.06F : 2.06F, 0.05F, 0.05F}};
      STRATA_ASSERT_OK(grid.Add(cloud, Pose(Eigen::Translation3d(0.05, 0.0, 0.0)), {}, Stop()));
      odds += Logit(hit ? model.hit : model.miss);
      odds = std::clamp(odds, Logit(model.least), Logit(model.most));
      OccupancyReader reader(grid);
      EXPECT_NEAR(reader.Probability({11, 0, 0}), 1.0 / (1.0 + std::exp(-odds)), 0.01) << scan;
    }
    OccupancyReader reader(grid);
    EXPECT_EQ(reader.Odds({-1, 0, 0}), OccupancyVoxels::kUnknownOdds);
    EXPECT_EQ(reader.Probability({-1, 0, 0}), 0.5);
  }
}

TEST(OccupancyVoxelsTest, ProbabilitiesAreOctoMaps) {
  constexpr int kSeed = 11;
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<float> place(-1.0F, 1.0F);
  OccupancyVoxels grid{OccupancyVoxelsOptions()};
  octomap::OcTree theirs(0.1);
  for (int scan = 0; scan < 6; ++scan) {
    const Eigen::Vector3f from = Eigen::Vector3f(0.31F, -0.22F, 0.13F) * static_cast<float>(scan);
    PointCloud cloud;
    octomap::Pointcloud points;
    for (int i = 0; i < 20'000; ++i) {
      const float x = place(random);
      const float y = place(random);
      const float z = place(random);
      const Eigen::Vector3f p(x, y, z);
      const Eigen::Vector3f onto = p / p.cwiseAbs().maxCoeff() * 2.05F;  // a cube
      cloud.points.push_back(onto - from);
      points.push_back(onto.x(), onto.y(), onto.z());
    }
    STRATA_ASSERT_OK(grid.Add(cloud, Pose(Eigen::Translation3d(from.cast<double>())), {}, Stop()));
    theirs.insertPointCloud(points, {from.x(), from.y(), from.z()}, -1.0, false, true);
  }
  theirs.expand();
  OccupancyReader reader(grid);
  std::size_t known = 0, differ = 0;
  for (auto leaf = theirs.begin_leafs(); leaf != theirs.end_leafs(); ++leaf) {
    const Eigen::Vector3d middle(leaf.getX(), leaf.getY(), leaf.getZ());
    const Eigen::Vector3i at = (middle / 0.1).array().floor().cast<int>();
    const double p = reader.Probability(at);
    ++known;
    differ += std::abs(p - leaf->getOccupancy()) > 0.02;
  }
  EXPECT_GT(known, 60'000U);
  EXPECT_NEAR(static_cast<double>(grid.CountKnown(OccupancyVoxelsOptions().region)),
              static_cast<double>(known),
              0.01 * known);
  // Theirs casts rays to the middles of voxels, ours to the points themselves.
  EXPECT_LT(differ, known / 20);
  RecordProperty("differ", static_cast<int>(differ));
}

// As where rays graze a floor: some end in a voxel, others go through it above. In any order.
TEST(OccupancyVoxelsTest, WhatWasHitStaysAndLetsPassAboveWhereItWasHit) {
  PointCloud end;
  end.points = {{1.05F, 0.05F, 0.01F}};
  PointCloud pass;
  pass.points = {{3.05F, 0.05F, 0.08F}};
  OccupancyVoxelsOptions options;
  options.model = InverseSensorModel::OfOneLook();
  for (const auto& clouds : {std::vector<PointCloud>{end, pass, pass, pass},
                             std::vector<PointCloud>{pass, pass, end, pass}}) {
    OccupancyVoxels grid(options);
    for (const PointCloud& cloud : clouds) {
      STRATA_ASSERT_OK(grid.Add(cloud, Pose::Identity(), {}, Stop()));
    }
    OccupancyReader reader(grid);
    EXPECT_GT(reader.Probability({10, 0, 0}), 0.95);
    EXPECT_LT(reader.Probability({20, 0, 0}), 0.15);
    EXPECT_TRUE(reader.Passes({10, 0, 0}, 0.5, 0.6));
    EXPECT_FALSE(reader.Passes({10, 0, 0}, 0.5, 0.05));  // down to where it was hit
    EXPECT_FALSE(reader.Passes({30, 0, 0}, 0.1, 0.2));   // an end that nothing passed
  }
}

TEST(OccupancyVoxelsTest, BeyondTheSensorsRangeARayTellsOfFreeSpaceUpToIt) {
  OccupancyVoxels grid{OccupancyVoxelsOptions()};
  SensorModel sensor;
  sensor.min_range_m = 0.5;
  sensor.max_range_m = 2.0;
  PointCloud cloud;
  cloud.points = {{7.0F, 0.05F, 0.05F}, {0.05F, 0.3F, 0.05F}, {0.0F, 0.0F, 1.0F}};
  STRATA_ASSERT_OK(grid.Add(cloud, Pose(Eigen::Translation3d(0.05, 0.05, 0.05)), sensor, Stop()));
  OccupancyReader reader(grid);
  for (int x = 0; x < 20; ++x) EXPECT_LT(reader.Probability({x, 0, 0}), 0.5) << x;
  EXPECT_EQ(reader.Odds({21, 0, 0}), OccupancyVoxels::kUnknownOdds);
  EXPECT_EQ(reader.Odds({70, 1, 1}), OccupancyVoxels::kUnknownOdds);
  EXPECT_EQ(reader.Odds({0, 2, 0}), OccupancyVoxels::kUnknownOdds);  // nearer than it sees
  EXPECT_GT(reader.Probability({0, 0, 10}), 0.5);
}

// As far as OctoMap's files reach, or as far as is said: UTM is farther.
TEST(OccupancyVoxelsTest, MapsMayLieFarAway) {
  const Pose far(Eigen::Translation3d(4e5 + 0.05, 5e6 + 0.05, 0.05));
  PointCloud cloud;
  cloud.points = {{1.0F, 0.0F, 0.0F}};
  OccupancyVoxelsOptions options;
  OccupancyVoxels near(options);
  EXPECT_THAT(near.Add(cloud, far, SensorModel(), Stop()),
              StatusIs(absl::StatusCode::kOutOfRange, HasSubstr("3276.8 m")));
  options.farthest_voxel = kMostNodes;
  STRATA_ASSERT_OK(options.Validate());
  OccupancyVoxels grid(options);
  STRATA_ASSERT_OK(grid.Add(cloud, far, SensorModel(), Stop()));
  OccupancyReader reader(grid);
  EXPECT_GT(reader.Probability({4'000'010, 50'000'000, 0}), 0.5);
  EXPECT_LT(reader.Probability({4'000'005, 50'000'000, 0}), 0.5);
}

TEST(OccupancyVoxelsTest, ModelsOutOfRangeAreNamed) {
  OccupancyVoxelsOptions options;
  options.model.hit = 0.99;
  EXPECT_THAT(options.Validate(),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("hit is 0.99")));
  options = {};
  options.model.miss = std::nan("");
  EXPECT_THAT(options.Validate(), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("miss")));
}

}  // namespace
}  // namespace strata
