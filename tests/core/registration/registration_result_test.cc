#include "core/registration/registration_result.h"

#include <cmath>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata {
namespace {

TEST(SolveNormalEquationsTest, FullRankEqualsCholesky) {
  Matrix6d A = Matrix6d::Random();
  const Matrix6d H = A * A.transpose() + 0.1 * Matrix6d::Identity();
  const Vector6d b = Vector6d::LinSpaced(-1.0, 2.0);
  const NormalStep step = SolveNormalEquations(H, b, 7.0, 1e-9);
  EXPECT_TRUE(step.step.isApprox(H.llt().solve(b), 1e-9));
  EXPECT_THAT(step.degenerate_directions, ::testing::IsEmpty());
  EXPECT_EQ(step.information, H);
}

TEST(SolveNormalEquationsTest, UndeterminedDirectionGetsNoStep) {
  Matrix6d H = Matrix6d::Identity();
  H(4, 4) = 1e-7;  // free along y
  const NormalStep step = SolveNormalEquations(H, Vector6d::Ones(), 1.0, 1e-3);
  ASSERT_EQ(step.degenerate_directions.size(), 1U);
  EXPECT_NEAR(std::abs(step.degenerate_directions[0][4]), 1.0, 1e-6);
  EXPECT_NEAR(step.step[4], 0.0, 1e-9);
  EXPECT_NEAR(step.step[3], 1.0, 1e-9);
  EXPECT_NEAR(step.information(4, 4), 0.0, 1e-12);
  H(4, 4) = 0.0;
  EXPECT_TRUE(step.information.isApprox(H, 1e-9));
}

TEST(TerminationTest, EveryOneHasAName) {
  EXPECT_EQ(ToString(Termination::kConverged), "converged");
  EXPECT_EQ(ToString(Termination::kMaxIterations), "max iterations");
  EXPECT_EQ(ToString(Termination::kTooLittleOverlap), "too little overlap");
  EXPECT_EQ(ToString(Termination::kDegenerate), "degenerate");
  EXPECT_EQ(ToString(Termination::kDiverged), "diverged");
}

}  // namespace
}  // namespace strata
