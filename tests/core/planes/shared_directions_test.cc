#include "core/planes/shared_directions.h"

#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/geometry/pose.h"
#include "core/planes/scan_planes.h"
#include "core/planes/shared_planes.h"

namespace strata {
namespace {

// A flat square of the map as the scan at `T_map_scan` sees it.
PlanePatch SquareAt(const Eigen::Vector3d& centre,
                    const Eigen::Vector3d& normal,
                    double side_m,
                    const Pose& T_map_scan) {
  const Pose T_scan_map = T_map_scan.inverse();
  PlanePatch patch;
  patch.plane.normal = T_scan_map.linear() * normal.normalized();
  patch.centroid = T_scan_map * centre;
  patch.plane.distance = patch.plane.normal.dot(patch.centroid);
  patch.axis_u = patch.plane.normal.unitOrthogonal();
  const Eigen::Vector3d axis_v = patch.plane.normal.cross(patch.axis_u);
  patch.extent_max = Eigen::Vector2d::Constant(side_m / 2.0);
  patch.extent_min = -patch.extent_max;
  patch.area_m2 = side_m * side_m;
  patch.rms_m = 0.01;
  patch.moments.setZero();
  for (const double a : {-0.5, 0.5}) {
    for (const double b : {-0.5, 0.5}) {
      const Eigen::Vector4d p =
          (patch.centroid + side_m * (a * patch.axis_u + b * axis_v)).homogeneous();
      patch.moments += patch.area_m2 / 4.0 * p * p.transpose();
    }
  }
  return patch;
}

Pose TurnedBy(const Eigen::Vector3d& rotation) {
  Pose T = Pose::Identity();
  T.linear() = So3Exp(rotation);
  return T;
}

class SharedDirectionsTest : public ::testing::Test {
 protected:
  SharedDirectionsTest() : truth_{TurnedBy({0.1, 0.0, 0.4}), TurnedBy({0.0, -0.1, 2.0})} {}

  void See(std::size_t scan,
           const Eigen::Vector3d& centre,
           const Eigen::Vector3d& normal,
           double side_m = 3.0) {
    planes_[scan].patches.push_back(SquareAt(centre, normal, side_m, truth_[scan]));
  }
  // The second scan's pose off by `error`.
  std::vector<SharedDirection> Find(const Eigen::Vector3d& error = Eigen::Vector3d::Zero()) {
    const std::vector<PosedPlanes> posed = {{&planes_[0], truth_[0]},
                                            {&planes_[1], TurnedBy(error) * truth_[1]}};
    return FindSharedDirections(posed);
  }

  std::vector<Pose> truth_;
  ScanPlanes planes_[2];
};

TEST_F(SharedDirectionsTest, AreOfSurfacesThatAreParallelThoughNobodySawTheSame) {
  const Eigen::Vector3d along = Eigen::Vector3d(1.0, 0.2, 0.0).normalized();
  const Eigen::Vector3d across = Eigen::Vector3d(-0.2, 1.0, 0.0).normalized();
  See(0, {0, 5, 1}, along);
  See(0, {9, 2, 1}, -along, 2.0);
  See(0, {3, 3, 1}, across);
  See(1, {40, 7, 2}, -along);
  See(1, {44, 1, 2}, across, 2.5);
  See(1, {50, 1, 2}, {1.0, 1.0, 0.5});  // a roof that only this one saw
  const Eigen::Vector3d error(0.004, -0.003, 0.006);
  const std::vector<SharedDirection> found = Find(error);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_NEAR(found[0].area_m2, 22.0, 1e-9);
  for (const SharedDirection& direction : found) {
    ASSERT_EQ(direction.views.size(), 2U);
    const Eigen::Vector3d& truth =
        std::abs(direction.direction_map.dot(along)) > 0.9 ? along : across;
    EXPECT_LT(direction.direction_map.cross(truth).norm(), 0.007);
    for (const SharedDirection::View& view : direction.views) {
      EXPECT_LT((truth_[view.scan].linear() * view.normal_scan).cross(truth).norm(), 1e-9);
      EXPECT_GT(view.information, 1e4);
      EXPECT_LE(view.information, 1.0 / (kParallelSigmaRad * kParallelSigmaRad));
    }
  }
}

TEST_F(SharedDirectionsTest, WhatIsNotParallelOrSmallOrSeenByOneScanIsNone) {
  See(0, {0, 5, 1}, {1, 0, 0});
  See(1, {9, 2, 1}, {1, 0.15, 0});
  See(0, {3, 3, 1}, {0, 0, 1}, 0.7);
  See(1, {3, 3, 1}, {0, 0, 1}, 0.7);
  See(0, {7, 3, 1}, {0, 1, 0});
  See(0, {8, 9, 1}, {0, -1, 0});
  EXPECT_TRUE(Find().empty());
  See(1, {3, 3, 1}, {0, 1, 0.001});
  EXPECT_EQ(Find().size(), 1U);
}

}  // namespace
}  // namespace strata
