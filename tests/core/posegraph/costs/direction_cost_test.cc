#include "core/posegraph/costs/direction_cost.h"

#include <cmath>

#include <ceres/sphere_manifold.h>
#include <gtest/gtest.h>

#include "core/posegraph/costs/pose_block.h"
#include "core/posegraph/solver/manifolds.h"
#include "tests/core/posegraph/cost_jacobian.h"
#include "tests/core/posegraph/random_poses.h"

namespace strata {
namespace {

TEST(DirectionCostTest, IsOfTheAngleBetweenLinesAndItsDerivativesAreTrue) {
  const PoseManifold poses;
  const ceres::SphereManifold<3> directions;
  testing::RandomPoses random(5);
  for (int n = 0; n < 20; ++n) {
    const Pose T = random.AnyPose();
    const Eigen::Vector3d normal = random.Vector(1.0).normalized();
    const Eigen::Vector3d direction = random.Vector(1.0).normalized();
    const double information = 1.0 + 10.0 * std::abs(random.Normal());
    const PoseBlock pose = PoseBlockOf(T);
    const testing::Blocks blocks = {{pose.begin(), pose.end()},
                                    {direction.x(), direction.y(), direction.z()}};
    const DirectionCost cost(normal, information);
    testing::ExpectTrueJacobians(cost, blocks, {&poses, &directions}, 1e-7);
    const double angle = std::acos(std::min(1.0, std::abs((T.linear() * normal).dot(direction))));
    const double expected = information * std::pow(std::sin(angle), 2);
    EXPECT_NEAR(testing::ResidualsOf(cost, blocks).squaredNorm(), expected, 1e-9 * information);
    const DirectionCost opposite(-normal, information);
    EXPECT_NEAR(testing::ResidualsOf(opposite, blocks).squaredNorm(), expected, 1e-9 * information);
  }
}

}  // namespace
}  // namespace strata
