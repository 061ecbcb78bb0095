#include "core/posegraph/costs/relative_pose_cost.h"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "core/posegraph/costs/information_root.h"
#include "core/posegraph/costs/pose_block.h"
#include "core/posegraph/solver/manifolds.h"
#include "tests/core/posegraph/cost_jacobian.h"
#include "tests/core/posegraph/random_poses.h"

namespace strata {
namespace {

std::vector<double> BlockOf(const Pose& T) {
  const PoseBlock block = PoseBlockOf(T);
  return {block.begin(), block.end()};
}

class RelativePoseCostTest : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  testing::RandomPoses random_{GetParam()};
};

TEST_P(RelativePoseCostTest, DerivativesAreThoseByDifferences) {
  for (int n = 0; n < 20; ++n) {
    const Pose T_i = random_.AnyPose();
    const Pose T_j = random_.AnyPose();
    // Every angle but those beside π, where the error jumps.
    Pose T_i_j = Retract(T_i.inverse() * T_j, random_.Step(0.5, 1.0));
    const RelativePoseDerivatives d = DifferentiateRelativePose(T_i, T_j, T_i_j);
    EXPECT_EQ(d.error, RelativePoseError(T_i, T_j, T_i_j));
    const auto by_i = testing::NumericJacobian(
        [&](const Eigen::VectorXd& step) {
          return Eigen::VectorXd(RelativePoseError(Retract(T_i, step), T_j, T_i_j));
        },
        6);
    const auto by_j = testing::NumericJacobian(
        [&](const Eigen::VectorXd& step) {
          return Eigen::VectorXd(RelativePoseError(T_i, Retract(T_j, step), T_i_j));
        },
        6);
    EXPECT_LT((by_i - d.by_i).cwiseAbs().maxCoeff(), 1e-7);
    EXPECT_LT((by_j - d.by_j).cwiseAbs().maxCoeff(), 1e-7);
  }
}

TEST_P(RelativePoseCostTest, WeighedByInformationAndByTheWeightOfTheMoment) {
  const PoseManifold manifold;
  const Matrix6d information = random_.Information();
  double weight = 1.0;
  for (int n = 0; n < 20; ++n) {
    const Pose T_i = random_.AnyPose();
    const Pose T_j = random_.AnyPose();
    const Pose T_i_j = Retract(T_i.inverse() * T_j, random_.Step(0.5, 1.0));
    const RelativePoseCost cost(T_i_j, information, &weight);
    const testing::Blocks blocks = {BlockOf(T_i), BlockOf(T_j)};
    testing::ExpectTrueJacobians(cost, blocks, {&manifold, &manifold}, 1e-7);
    const Vector6d e = RelativePoseError(T_i, T_j, T_i_j);
    weight = 0.25 * n;
    const double expected = weight * e.dot(information * e);
    EXPECT_NEAR(testing::ResidualsOf(cost, blocks).squaredNorm(), expected, 1e-9 * expected);
  }
}

TEST_P(RelativePoseCostTest, ASmallErrorIsTheRightHandStep) {
  const Pose T_i = random_.AnyPose();
  const Pose T_i_j = random_.AnyPose();
  const Vector6d step = random_.Step(1e-3, 1.0);
  const Vector6d error = RelativePoseError(T_i, T_i * Retract(T_i_j, step), T_i_j);
  EXPECT_LT((error - step).cwiseAbs().maxCoeff(), 1e-8);
}

TEST_P(RelativePoseCostTest, TheMapFrameDoesNotMatter) {
  const Pose T_i = random_.AnyPose();
  const Pose T_j = random_.AnyPose();
  const Pose T_i_j = random_.AnyPose();
  const Pose moved = random_.AnyPose(1000.0);
  EXPECT_LT(
      (RelativePoseError(T_i, T_j, T_i_j) - RelativePoseError(moved * T_i, moved * T_j, T_i_j))
          .norm(),
      1e-9);
}

TEST_P(RelativePoseCostTest, ARootOfWhatKnowsNothingOfRotationsIsOne) {
  Matrix6d information = Matrix6d::Zero();
  EXPECT_EQ(InformationRoot(information), information);
  information.bottomRightCorner<3, 3>() = random_.Information().topLeftCorner<3, 3>();
  const Matrix6d root = InformationRoot(information);
  EXPECT_LT((root.transpose() * root - information).norm(), 1e-12 * information.norm());
}

INSTANTIATE_TEST_SUITE_P(Seeds, RelativePoseCostTest, ::testing::Values(1, 2, 3));

}  // namespace
}  // namespace strata
