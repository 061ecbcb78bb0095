#include "core/posegraph/information.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <gtest/gtest.h>

#include "tests/core/posegraph/random_poses.h"

namespace strata {
namespace {

using testing::RandomPoses;

TEST(InformationTest, IsotropicIsOfIndependentAxesRotationFirst) {
  const Matrix6d covariance = IsotropicInformation(0.01, 0.2).inverse();
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(0.0001), Eigen::Vector3d::Constant(0.04);
  EXPECT_LT((covariance - Matrix6d(variances.asDiagonal())).norm(), 1e-12);
}

TEST(InformationTest, LoosenedIsTheInverseOfTheSumOfCovariances) {
  RandomPoses random(3);
  for (int trial = 0; trial < 50; ++trial) {
    SCOPED_TRACE(trial);
    const Matrix6d information = random.Information();
    const Matrix6d extra = random.Information();
    const Matrix6d sum = information.inverse() + extra.inverse();
    const Matrix6d loosened = LoosenedInformation(information, extra);
    EXPECT_LT((loosened * sum - Matrix6d::Identity()).norm(), 1e-9);
    EXPECT_EQ(loosened, Matrix6d(loosened.transpose()));
  }
}

TEST(InformationTest, WhatNothingIsKnownAboutStaysUnknown) {
  RandomPoses random(4);
  for (int trial = 0; trial < 50; ++trial) {
    SCOPED_TRACE(trial);
    // A registration in a corridor: one direction is free.
    const Vector6d free = random.Step(1.0, 1.0).normalized();
    const Matrix6d others = Matrix6d::Identity() - free * free.transpose();
    const Matrix6d information = others * random.Information() * others;
    const Matrix6d extra = IsotropicInformation(0.001, 0.01);
    const Matrix6d loosened = LoosenedInformation(information, extra);
    EXPECT_LT((loosened * free).norm(), 1e-9 * extra.norm());
    // The limit of ever weaker information along it.
    const double weak = 1e-6;
    const Matrix6d regular = information + weak * free * free.transpose();
    const Matrix6d limit = Matrix6d(regular.inverse() + extra.inverse()).inverse();
    EXPECT_LT((loosened - limit).norm(), 1e-4);
    // Nothing becomes better known, and nothing is less than unknown.
    const double scale = extra.norm();
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(loosened).eigenvalues().minCoeff(),
              -1e-9 * scale);
    EXPECT_GT(
        Eigen::SelfAdjointEigenSolver<Matrix6d>(information - loosened).eigenvalues().minCoeff(),
        -1e-9 * scale);
  }
}

TEST(InformationTest, WhatIsKnownLessIsTakenFromTheOther) {
  RandomPoses random(5);
  for (int trial = 0; trial < 50; ++trial) {
    SCOPED_TRACE(trial);
    const Matrix6d other = random.Information();
    // Any basis in which the other is the identity: knowledge of 0, 1, …, 5 times as much.
    const Matrix6d root = other.llt().matrixL();
    const Eigen::HouseholderQR<Matrix6d> random_basis(random.Information());
    const Matrix6d Q = random_basis.householderQ();
    const Vector6d times = Vector6d::LinSpaced(0.0, 5.0);
    const Matrix6d information = root * Q * times.asDiagonal() * Q.transpose() * root.transpose();
    Vector6d less = Vector6d::Zero();
    less.head<3>().setOnes();  // than 2.5 times
    const Matrix6d expected = root * Q * less.asDiagonal() * Q.transpose() * root.transpose();
    EXPECT_TRUE(WhereLess(information, other, 2.5).isApprox(expected, 1e-7));
    EXPECT_TRUE(WhereLess(10.0 * other, other, 2.5).isZero());
    EXPECT_TRUE(WhereLess(Matrix6d::Zero(), other, 2.5).isApprox(other, 1e-9));
  }
}

TEST(InformationTest, NothingKnownStaysNothing) {
  EXPECT_EQ(LoosenedInformation(Matrix6d::Zero(), IsotropicInformation(0.1, 0.1)).norm(), 0.0);
}

TEST(G2oInformationTest, ChangesTheErrorNotTheCost) {
  RandomPoses random(5);
  const Matrix6d g2o = random.Information();
  const Vector6d error = random.Step(1.0, 1.0);
  Vector6d g2o_error;  // [translation, vec q]
  g2o_error << error.tail<3>(), 0.5 * error.head<3>();
  EXPECT_NEAR(error.dot(InformationFromG2o(g2o) * error), g2o_error.dot(g2o * g2o_error), 1e-12);
  EXPECT_LT((InformationToG2o(InformationFromG2o(g2o)) - g2o).norm(), 1e-12);
}

}  // namespace
}  // namespace strata
