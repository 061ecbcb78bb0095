#include "client/cli/posegraph/constraint_residual.h"

#include <cmath>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata::cli {
namespace {

using ::testing::SizeIs;

PoseNode NodeAt(const ScanId& id, const Pose& T_map_scan) {
  PoseNode node;
  node.id = id;
  node.T_map_scan = T_map_scan;
  return node;
}

// With a rotation far from the identity in each pose.
TEST(ConstraintResidualTest, IsTheStepFromWhatIsSaidToWhatIs) {
  const Pose T_map_i =
      MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, 2, -1).normalized())),
               {5, -3, 1});
  const Pose T_i_j =
      MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(-1.2, Eigen::Vector3d(0, 1, 1).normalized())),
               {1, 4, 2});
  Vector6d step;
  step << 0.02, -0.01, 0.03, 0.1, 0.2, -0.3;
  const Eigen::Vector3d half = 0.5 * step.head<3>();
  const Eigen::Quaterniond turn(
      -std::sqrt(1.0 - half.squaredNorm()), -half.x(), -half.y(), -half.z());
  api::PoseGraphState state;
  state.nodes = {NodeAt({"a", 1}, T_map_i),
                 NodeAt({"a", 2}, T_map_i * T_i_j * MakePose(turn, step.tail<3>()))};
  Constraint constraint;
  constraint.i = {"a", 1};
  constraint.j = {"a", 2};
  constraint.T_i_j = T_i_j;
  constraint.information.diagonal() << 100, 200, 300, 4, 5, 6;
  state.constraints = {constraint};
  const std::vector<ConstraintResidual> residuals = ResidualsOf(state);
  ASSERT_THAT(residuals, SizeIs(1));
  const double chi2 = 100 * 0.0004 + 200 * 0.0001 + 300 * 0.0009 + 4 * 0.01 + 5 * 0.04 + 6 * 0.09;
  EXPECT_NEAR(residuals[0].normalised_chi2, chi2 / 6, 1e-9);
  EXPECT_NEAR(residuals[0].rotation_rad, 2.0 * std::asin(half.norm()), 1e-9);
  EXPECT_NEAR(residuals[0].translation_m, step.tail<3>().norm(), 1e-9);
  EXPECT_EQ(residuals[0].constraint, &state.constraints[0]);
}

TEST(ConstraintResidualTest, APriorOnThePositionHasThreeDirections) {
  api::PoseGraphState state;
  state.nodes = {NodeAt({"a", 1}, MakePose(Eigen::Quaterniond(0, 1, 0, 0), {1, 2, 5}))};
  Constraint prior;
  prior.j = {"a", 1};
  prior.T_i_j = MakePose(Eigen::Quaterniond::Identity(), {1, 2, 3});
  prior.information.diagonal() << 0, 0, 0, 9, 9, 9;
  state.constraints = {prior};
  const std::vector<ConstraintResidual> residuals = ResidualsOf(state);
  ASSERT_THAT(residuals, SizeIs(1));
  EXPECT_NEAR(residuals[0].normalised_chi2, 9.0 * 4.0 / 3.0, 1e-9);
  EXPECT_NEAR(residuals[0].translation_m, 2.0, 1e-9);
  EXPECT_EQ(residuals[0].T_map_i.translation().z(), 3.0);
}

TEST(ConstraintResidualTest, WhatHasNoNodeHasNoResidual) {
  api::PoseGraphState state;
  state.nodes = {NodeAt({"a", 1}, Pose::Identity())};
  Constraint constraint;
  constraint.i = {"a", 1};
  constraint.j = {"gone", 2};
  state.constraints = {constraint};
  EXPECT_THAT(ResidualsOf(state), SizeIs(0));
}

}  // namespace
}  // namespace strata::cli
