#include "core/tracking/pose_filter.h"

#include <cstdint>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

using ::strata::testing::Random;

Vector6d Drawn(const Matrix6d& covariance, Random& random) {
  Vector6d unit;
  for (int i = 0; i < 6; ++i) unit[i] = random.Gaussian();
  return Matrix6d(covariance.llt().matrixL()) * unit;
}

Vector6d ErrorOf(const Pose& estimate, const Pose& truth) {
  const Pose off = estimate.inverse() * truth;
  Vector6d error;
  error << So3Log(off.linear()), off.translation();
  return error;
}

Matrix6d Covariance(double sigma_rad, double sigma_m) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(sigma_rad * sigma_rad),
      Eigen::Vector3d::Constant(sigma_m * sigma_m);
  return variances.asDiagonal();
}

Pose Motion(double way_m, double turn_rad) {
  return Pose(Eigen::Translation3d(way_m, 0.1, 0.02) *
              Eigen::AngleAxisd(turn_rad, Eigen::Vector3d(0.1, 0.2, 1.0).normalized()));
}

// Errors that are drawn as the filter believes are as large as it says: NEES of 6 degrees of
// freedom, with the covariance by its own arithmetic.
TEST(PoseFilterTest, ErrorsAreAsLargeAsItSays) {
  constexpr std::uint64_t kSeed = 7;
  SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
  Random random(kSeed);
  const Matrix6d measured = Covariance(0.01, 0.05);
  double predicted_nees = 0.0;
  double nees = 0.0;
  int count = 0;
  for (int run = 0; run < 200; ++run) {
    const Matrix6d begin = Covariance(0.05, 0.3);
    Pose truth = Motion(3.0, 0.5);
    PoseFilter filter(Retract(truth, -Drawn(begin, random)), begin);
    for (int k = 0; k < 10; ++k) {
      const Pose motion = Motion(1.5, 0.2 * (k % 3));
      truth = Normalized(truth * motion);
      const Matrix6d noise = MotionCovariance(motion);
      filter.Predict(Retract(motion, Drawn(noise, random)), noise);
      const Vector6d off = ErrorOf(filter.pose(), truth);
      predicted_nees += off.dot(filter.Covariance().inverse() * off);
      filter.Update(Retract(truth, Drawn(measured, random)), measured.inverse());
      const Vector6d error = ErrorOf(filter.pose(), truth);
      nees += error.dot(filter.Covariance().inverse() * error);
      ++count;
    }
  }
  // σ of the mean of 2,000 is 0.08, and runs are correlated.
  EXPECT_NEAR(predicted_nees / count, 6.0, 0.5);
  EXPECT_NEAR(nees / count, 6.0, 0.5);
}

// Against the covariance form of the same filter.
TEST(PoseFilterTest, AgreesWithAKalmanFilter) {
  const Pose T = Motion(10.0, 1.0);
  Matrix6d P = Covariance(0.03, 0.2);
  PoseFilter filter(T, P);
  const Pose motion = Motion(2.0, 0.4);
  const Matrix6d Q = MotionCovariance(motion);
  filter.Predict(motion, Q);
  // The adjoint by differences of what a step before the motion does behind it.
  Matrix6d A;
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 6; ++i) {
    A.col(i) = ErrorOf(T * motion, Retract(T, kStep * Vector6d::Unit(i)) * motion) / kStep;
  }
  P = A * P * A.transpose() + Q;
  EXPECT_LT((filter.Covariance() - P).norm(), 1e-6 * P.norm());
  EXPECT_TRUE(filter.pose().isApprox(T * motion, 1e-12));
  const Matrix6d R = Covariance(0.02, 0.1);
  Vector6d step;
  step << 0.01, -0.02, 0.005, 0.1, -0.05, 0.02;
  const Pose measured = Retract(T * motion, step);
  const Matrix6d S = P + R;
  EXPECT_NEAR(filter.InnovationOf(measured, R.inverse()), step.dot(S.inverse() * step), 1e-5);
  filter.Update(measured, R.inverse());
  const Matrix6d K = P * S.inverse();
  EXPECT_LT((filter.Covariance() - (Matrix6d::Identity() - K) * P).norm(), 1e-6 * P.norm());
  EXPECT_LT(ErrorOf(filter.pose(), Retract(T * motion, K * step)).norm(), 1e-6);
}

TEST(PoseFilterTest, WhatAMeasurementKnowsNothingOfStays) {
  const Matrix6d P = Covariance(0.03, 0.2);
  PoseFilter filter(Pose::Identity(), P);
  Matrix6d information = Matrix6d::Zero();
  EXPECT_EQ(filter.InnovationOf(Motion(5.0, 1.0), information), 0.0);
  filter.Update(Motion(5.0, 1.0), information);
  EXPECT_TRUE(filter.pose().isApprox(Pose::Identity()));
  information(4, 4) = 1e4;  // y alone
  Pose measured = Pose::Identity();
  measured.translation() = Eigen::Vector3d(7.0, 0.1, -3.0);
  EXPECT_NEAR(filter.InnovationOf(measured, information), 0.01 / (0.04 + 1e-4), 1e-9);
  filter.Update(measured, information);
  EXPECT_NEAR(filter.pose().translation().x(), 0.0, 1e-12);
  EXPECT_NEAR(filter.pose().translation().y(), 0.1 * 0.04 / (0.04 + 1e-4), 1e-9);
  EXPECT_NEAR(filter.Covariance()(3, 3), 0.04, 1e-9);
}

}  // namespace
}  // namespace strata
