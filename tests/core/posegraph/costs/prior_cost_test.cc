#include "core/posegraph/costs/prior_cost.h"

#include <vector>

#include <gtest/gtest.h>

#include "core/posegraph/costs/pose_block.h"
#include "core/posegraph/costs/relative_pose_cost.h"
#include "core/posegraph/solver/manifolds.h"
#include "tests/core/posegraph/cost_jacobian.h"
#include "tests/core/posegraph/random_poses.h"

namespace strata {
namespace {

TEST(PriorCostTest, IsOfTheErrorFromTheMap) {
  const PoseManifold manifold;
  testing::RandomPoses random(3);
  for (int n = 0; n < 20; ++n) {
    const Matrix6d information = random.Information();
    const Pose T = random.AnyPose();
    const Pose measured = Retract(T, random.Step(0.5, 1.0));
    const double weight = 1.0;
    const PriorCost cost(measured, information, &weight);
    const PoseBlock block = PoseBlockOf(T);
    const testing::Blocks blocks = {{block.begin(), block.end()}};
    testing::ExpectTrueJacobians(cost, blocks, {&manifold}, 1e-7);
    const Vector6d e = RelativePoseError(Pose::Identity(), T, measured);
    const double expected = e.dot(information * e);
    EXPECT_NEAR(testing::ResidualsOf(cost, blocks).squaredNorm(), expected, 1e-9 * expected);
  }
}

}  // namespace
}  // namespace strata
