#include "core/posegraph/costs/planar_cost.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/posegraph/solver/manifolds.h"
#include "tests/core/posegraph/cost_jacobian.h"
#include "tests/core/posegraph/random_poses.h"

namespace strata {
namespace {

TEST(PlanarCostTest, DerivativesAreThoseByDifferences) {
  const PlanarPoseManifold manifold;
  testing::RandomPoses random(1);
  const auto any_pose = [&random]() -> PlanarPose {
    return {random.Normal(10.0), random.Normal(10.0), WrapAngle(random.Normal(2.0))};
  };
  double weight = 1.0;
  for (int n = 0; n < 20; ++n) {
    const PlanarPose i = any_pose();
    const PlanarPose j = any_pose();
    const PlanarPose T_i_j = Moved(PlanarError(i, j, PlanarPose::Zero()), random.Vector(0.5));
    const Eigen::Matrix3d information = random.Information().topLeftCorner<3, 3>();
    const PlanarRelativeCost cost(T_i_j, information, &weight);
    const testing::Blocks blocks = {{i.x(), i.y(), i.z()}, {j.x(), j.y(), j.z()}};
    testing::ExpectTrueJacobians(cost, blocks, {&manifold, &manifold}, 1e-7);
    weight = 0.25 * n;
    const Eigen::Vector3d e = PlanarError(i, j, T_i_j);
    const double expected = weight * e.dot(information * e);
    EXPECT_NEAR(testing::ResidualsOf(cost, blocks).squaredNorm(), expected, 1e-9 * expected);
  }
}

TEST(WrapAngleTest, IsHalfOpen) {
  EXPECT_DOUBLE_EQ(WrapAngle(3.0 * M_PI), M_PI);
  EXPECT_DOUBLE_EQ(WrapAngle(-M_PI), M_PI);
  EXPECT_NEAR(WrapAngle(2.0 * M_PI + 0.5), 0.5, 1e-12);
  EXPECT_NEAR(WrapAngle(-2.0 * M_PI - 0.5), -0.5, 1e-12);
}

}  // namespace
}  // namespace strata
