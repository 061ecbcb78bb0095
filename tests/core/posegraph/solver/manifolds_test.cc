#include "core/posegraph/solver/manifolds.h"

#include <array>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/posegraph/costs/plane_cost.h"
#include "core/posegraph/costs/pose_block.h"
#include "tests/core/posegraph/random_poses.h"

namespace strata {
namespace {

Pose Moved(const Pose& T, const Vector6d& step) {
  PoseBlock moved;
  EXPECT_TRUE(PoseManifold().Plus(PoseBlockOf(T).data(), step.data(), moved.data()));
  return PoseOf(moved.data());
}

TEST(PoseManifoldTest, ASmallStepIsTheRightHandStep) {
  testing::RandomPoses random(1);
  for (const double size : {1e-3, 1e-5, 1e-9}) {
    const Pose T = random.AnyPose();
    const Vector6d step = random.Step(size, size);
    EXPECT_LT((Moved(T, step).matrix() - Retract(T, step).matrix()).norm(),
              1e-14 + 10.0 * size * size);
  }
}

TEST(PoseManifoldTest, ALongStepAboutOneAxisTurnsAllPosesAsOneBody) {
  testing::RandomPoses random(2);
  const Eigen::Vector3d axis = random.Vector(1.0);
  const Pose turn = MakePose(Eigen::Quaterniond(So3Exp(axis)), Eigen::Vector3d::Zero());
  for (int n = 0; n < 10; ++n) {
    const Pose T = random.AnyPose();
    Vector6d step;  // of a point that turns about the map's origin, as the pose sees it
    step << T.linear().transpose() * axis, T.linear().transpose() * axis.cross(T.translation());
    EXPECT_LT((Moved(T, step).matrix() - (turn * T).matrix()).norm(), 1e-12);
  }
}

TEST(PoseManifoldTest, NumbersThatAreNoneAreRefused) {
  PoseBlock moved;
  const Vector6d step = Vector6d::Constant(std::numeric_limits<double>::infinity());
  EXPECT_FALSE(
      PoseManifold().Plus(PoseBlockOf(Pose::Identity()).data(), step.data(), moved.data()));
}

TEST(PlaneManifoldTest, NormalsStayOfLengthOneAndFollowTheJacobian) {
  testing::RandomPoses random(3);
  const PlaneManifold manifold;
  const PlaneBlock block = PlaneBlockOf({random.Vector(1.0).normalized(), 2.0}, {1.0, 2.0, 3.0});
  Eigen::Matrix<double, 4, 3, Eigen::RowMajor> J;
  ASSERT_TRUE(manifold.PlusJacobian(block.data(), J.data()));
  for (const double size : {1e-4, 1.0, 100.0}) {
    const Eigen::Vector3d step = random.Vector(size);
    PlaneBlock moved;
    ASSERT_TRUE(manifold.Plus(block.data(), step.data(), moved.data()));
    EXPECT_NEAR(std::hypot(moved[0], moved[1], moved[2]), 1.0, 1e-12);
    EXPECT_NEAR(moved[3], block[3] + step[2], 1e-12);
    if (size > 1e-3) continue;
    const Eigen::Vector4d change = Eigen::Vector4d(moved.data()) - Eigen::Vector4d(block.data());
    EXPECT_LT((change - J * step).norm(), 10.0 * size * size);
  }
}

}  // namespace
}  // namespace strata
