// Octrees written by us and read by OctoMap.
#include "client/formats/grid/octree_writer.h"

#include <cmath>
#include <limits>
#include <random>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <octomap/octomap.h>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/occupancy/occupancy_voxels.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

enum class Space { kUnknown, kFree, kOccupied };

Space At(const octomap::OcTree& tree, double x, double y, double z) {
  const octomap::OcTreeNode* const node = tree.search(x, y, z);
  if (node == nullptr) return Space::kUnknown;
  return tree.isNodeOccupied(node) ? Space::kOccupied : Space::kFree;
}

// A sensor at (0, 0, 1) before a wall at x = 4.05 that reaches from z = 0 to 2, |y| < 2.
PointCloud Wall() {
  PointCloud cloud;
  cloud.sensor_origin = {0.0F, 0.0F, 1.0F};
  for (int y = -39; y < 40; ++y) {
    for (int z = 0; z < 40; ++z) {
      cloud.points.emplace_back(
          4.05F, 0.05F * static_cast<float>(y) + 0.01F, 0.05F * static_cast<float>(z) + 0.01F);
    }
  }
  return cloud;
}

OccupancyVoxels GridOf(double voxel_m) {
  OccupancyVoxelsOptions options;
  options.voxel_m = voxel_m;
  return OccupancyVoxels(options);
}

void ReadBack(const OccupancyVoxels& grid, octomap::OcTree& tree) {
  const OctreeFile written = BtFile(grid);
  std::istringstream file(written.bytes);
  ASSERT_TRUE(tree.readBinary(file));
  EXPECT_EQ(tree.size(), written.nodes);
  EXPECT_EQ(tree.calcNumNodes(), written.nodes);
  octomap::OcTree pruned(tree);
  pruned.prune();
  EXPECT_EQ(pruned.size(), written.nodes);  // nothing is left to put together
  double occupied = 0.0, free = 0.0;
  for (auto leaf = tree.begin_leafs(); leaf != tree.end_leafs(); ++leaf) {
    (tree.isNodeOccupied(*leaf) ? occupied : free) += std::pow(leaf.getSize(), 3);
  }
  EXPECT_NEAR(occupied, written.occupied_m3, 1e-6 * (1.0 + occupied));
  EXPECT_NEAR(free, written.free_m3, 1e-6 * (1.0 + free));
}

TEST(OctreeWriterTest, FreeBeforeAWallUnknownBehind) {
  OccupancyVoxels grid = GridOf(0.1);
  STRATA_ASSERT_OK(grid.Add(Wall(), Pose::Identity(), {}, Stop()));
  octomap::OcTree tree(1.0);
  ReadBack(grid, tree);
  EXPECT_NEAR(tree.getResolution(), 0.1, 1e-12);
  for (const double y : {-1.5, 0.0, 1.5}) {
    EXPECT_EQ(At(tree, 4.05, y, 1.0), Space::kOccupied) << y;
    EXPECT_EQ(At(tree, 2.05, y / 2.0, 1.0), Space::kFree) << y;
    EXPECT_EQ(At(tree, 4.25, y, 1.0), Space::kUnknown) << y;
  }
  EXPECT_EQ(At(tree, -0.5, 0.0, 1.0), Space::kUnknown);
  EXPECT_EQ(At(tree, 2.05, 0.0, 2.5), Space::kUnknown);
}

TEST(OctreeWriterTest, OccupiedAloneWhereFreeIsNotAskedFor) {
  OccupancyVoxels grid = GridOf(0.1);
  STRATA_ASSERT_OK(grid.Add(Wall(), Pose::Identity(), {}, Stop()));
  const OctreeFile written = BtFile(grid, false);
  EXPECT_EQ(written.free_m3, 0.0);
  EXPECT_EQ(written.occupied_m3, BtFile(grid).occupied_m3);
  std::istringstream file(written.bytes);
  octomap::OcTree tree(1.0);
  ASSERT_TRUE(tree.readBinary(file));
  EXPECT_EQ(At(tree, 4.05, 0.0, 1.0), Space::kOccupied);
  EXPECT_EQ(At(tree, 2.05, 0.0, 1.0), Space::kUnknown);
}

TEST(OctreeWriterTest, PosesMoveSensorAndPoints) {
  OccupancyVoxels grid = GridOf(0.1);
  const Pose T = MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ())),
                          {100.0, 50.0, -3.0});
  STRATA_ASSERT_OK(grid.Add(Wall(), T, {}, Stop()));
  octomap::OcTree tree(1.0);
  ReadBack(grid, tree);
  EXPECT_EQ(At(tree, 100.0, 54.05, -2.0), Space::kOccupied);
  EXPECT_EQ(At(tree, 100.0, 52.0, -2.0), Space::kFree);
  EXPECT_EQ(At(tree, 100.0, 54.3, -2.0), Space::kUnknown);
}

TEST(OctreeWriterTest, WhatWasSeenThroughOftenerThanHitIsFree) {
  PointCloud blob;
  blob.sensor_origin = {0.0F, 0.0F, 1.0F};
  blob.points = {{2.05F, 0.05F, 1.05F}};
  OccupancyVoxels grid = GridOf(0.1);
  STRATA_ASSERT_OK(grid.Add(blob, Pose::Identity(), {}, Stop()));
  for (int i = 0; i < 5; ++i) STRATA_ASSERT_OK(grid.Add(Wall(), Pose::Identity(), {}, Stop()));
  octomap::OcTree tree(1.0);
  ReadBack(grid, tree);
  EXPECT_EQ(At(tree, 2.05, 0.05, 1.05), Space::kFree);
}

TEST(OctreeWriterTest, OnlyTheRegionAndRaysThatLeaveIt) {
  const Eigen::AlignedBox3d region(Eigen::Vector3d(1.0, -0.5, 0.5), Eigen::Vector3d(3.0, 0.5, 1.5));
  OccupancyVoxelsOptions options;
  options.region = region;
  OccupancyVoxels grid(options);
  STRATA_ASSERT_OK(grid.Add(Wall(), Pose::Identity(), {}, Stop()));
  octomap::OcTree tree(1.0);
  ReadBack(grid, tree);
  EXPECT_EQ(At(tree, 2.05, 0.05, 1.05), Space::kFree);
  EXPECT_EQ(At(tree, 0.55, 0.05, 1.05), Space::kUnknown);
  EXPECT_EQ(At(tree, 3.55, 0.05, 1.05), Space::kUnknown);
  EXPECT_EQ(At(tree, 4.05, 0.05, 1.05), Space::kUnknown);
}

// More than the 15 bits that tell one scan from the next.
TEST(OctreeWriterTest, ScansAreToldApartHoweverManyThereAre) {
  PointCloud far_off;
  far_off.points = {{2.05F, 0.05F, 0.05F}};
  PointCloud near_by;
  near_by.points = {{1.05F, 0.05F, 0.05F}};
  OccupancyVoxels grid = GridOf(0.1);
  for (int i = 0; i < 32'770; ++i) {
    STRATA_ASSERT_OK(grid.Add(i < 32'760 ? far_off : near_by, Pose::Identity(), {}, Stop()));
  }
  octomap::OcTree tree(1.0);
  ReadBack(grid, tree);
  EXPECT_EQ(At(tree, 2.05, 0.05, 0.05), Space::kOccupied);
  EXPECT_EQ(At(tree, 1.05, 0.05, 0.05), Space::kOccupied);
  EXPECT_EQ(At(tree, 0.55, 0.05, 0.05), Space::kFree);
}

// The same scans into OctoMap's own insertion.
TEST(OctreeWriterTest, AgreesWithOctoMap) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-1.0F, 1.0F);
  OccupancyVoxels grid = GridOf(0.1);
  octomap::OcTree theirs(0.1);
  for (int scan = 0; scan < 4; ++scan) {
    PointCloud cloud;
    octomap::Pointcloud points;
    for (int i = 0; i < 50'000; ++i) {
      const Eigen::Vector3f p(place(random), place(random), place(random));
      const Eigen::Vector3f onto = p / p.cwiseAbs().maxCoeff() * 2.05F;  // a cube
      cloud.points.push_back(onto);
      points.push_back(onto.x(), onto.y(), onto.z());
    }
    STRATA_ASSERT_OK(grid.Add(cloud, Pose::Identity(), {}, Stop()));
    theirs.insertPointCloud(points, {0, 0, 0}, -1.0, false, true);
  }
  octomap::OcTree ours(1.0);
  ReadBack(grid, ours);
  int occupied = 0, free = 0, edges = 0, differ = 0;
  for (double x = -2.35; x < 2.4; x += 0.1) {
    for (double y = -2.35; y < 2.4; y += 0.1) {
      for (double z = -2.35; z < 2.4; z += 0.1) {
        const Space space = At(ours, x, y, z);
        const Space expected = At(theirs, x, y, z);
        edges += (space == Space::kOccupied) != (expected == Space::kOccupied);
        occupied += expected == Space::kOccupied;
        free += expected == Space::kFree;
        differ += space != expected;
      }
    }
  }
  EXPECT_GT(occupied, 3000);
  EXPECT_GT(free, 50'000);
  // Theirs casts rays to the middles of voxels.
  EXPECT_LT(edges, occupied / 50);
  EXPECT_LT(differ, free / 100);
  RecordProperty("differ", differ);
}

TEST(OctreeWriterTest, WhatDoesNotFitIsRefused) {
  OccupancyVoxels grid = GridOf(0.01);
  PointCloud cloud;
  cloud.points = {{1.0F, 0.0F, 0.0F}};
  const Pose far_off = Pose(Eigen::Translation3d(400.0, 0.0, 0.0));
  EXPECT_THAT(
      grid.Add(cloud, far_off, {}, Stop()),
      StatusIs(absl::StatusCode::kOutOfRange, HasSubstr("take larger ones or a region near 0")));
  const Stop stop;
  stop.Request();
  EXPECT_EQ(grid.Add(cloud, Pose::Identity(), {}, stop).code(), absl::StatusCode::kCancelled);
  cloud.points = {{std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F}, {0.0F, 0.0F, 0.0F}};
  OccupancyVoxels nothing = GridOf(0.1);
  STRATA_ASSERT_OK(nothing.Add(cloud, Pose::Identity(), {}, Stop()));
  EXPECT_EQ(BtFile(nothing).nodes, 0U);
}

}  // namespace
}  // namespace strata
