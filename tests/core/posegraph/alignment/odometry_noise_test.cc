#include "core/posegraph/alignment/odometry_noise.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "core/common/random.h"

namespace strata {
namespace {

using Errors = std::vector<std::optional<Pose>>;

double Gauss(SplitMix64& random) {
  double sum = -6.0;
  for (int k = 0; k < 12; ++k) sum += random.Uniform();
  return sum;
}

// Independent errors, and on top of them the same one again and again.
Errors Draw(std::size_t steps, double sigma_rad, double sigma_m, const Vector6d& bias) {
  SplitMix64 random(7);
  Errors errors;
  for (std::size_t k = 0; k < steps; ++k) {
    Vector6d error = bias;
    for (int axis = 0; axis < 3; ++axis) {
      error[axis] += sigma_rad * Gauss(random);
      error[3 + axis] += sigma_m * Gauss(random);
    }
    errors.push_back(Retract(Pose::Identity(), error));
  }
  return errors;
}

TEST(OdometryNoiseTest, FindsWhatWasPlanted) {
  const auto noise = EstimateOdometryNoise(Draw(2000, 0.004, 0.03, Vector6d::Zero()));
  ASSERT_TRUE(noise.has_value());
  EXPECT_NEAR(noise->sigma_rad, 0.004, 0.0006);
  EXPECT_NEAR(noise->sigma_m, 0.03, 0.004);
}

TEST(OdometryNoiseTest, ASmallErrorThatIsAlwaysTheSameCountsAsMuchAsItGrows) {
  Vector6d bias = Vector6d::Zero();
  bias[2] = 0.002;
  const auto noise = EstimateOdometryNoise(Draw(2000, 0.0005, 0.01, bias));
  ASSERT_TRUE(noise.has_value());
  // Ten steps: 0.02 rad about one axis, √(0.02² / 10 / 3) a step and axis.
  EXPECT_NEAR(noise->sigma_rad, 0.00365, 0.0005);
}

TEST(OdometryNoiseTest, ErrorsThatCancelAreNoBetterThanOne) {
  Errors errors;
  for (int k = 0; k < 100; ++k) {
    Pose error = Pose::Identity();
    error.translation().x() = k % 2 == 0 ? 0.05 : -0.05;
    errors.emplace_back(error);
  }
  EXPECT_NEAR(EstimateOdometryNoise(errors)->sigma_m, 0.05 / std::sqrt(3.0), 1e-9);
}

TEST(OdometryNoiseTest, GapsEndWhatIsSummedAndFewStepsSayNothing) {
  EXPECT_FALSE(EstimateOdometryNoise({}).has_value());
  EXPECT_FALSE(EstimateOdometryNoise(Draw(29, 0.01, 0.1, Vector6d::Zero())).has_value());
  Vector6d bias = Vector6d::Zero();
  bias[2] = 0.01;
  bias[3] = 0.1;
  const Errors whole = Draw(90, 0.0, 0.0, bias);
  Errors gaps;
  for (std::size_t k = 0; k < whole.size(); ++k) {
    gaps.push_back(whole[k]);
    if (k % 9 == 8) gaps.emplace_back(std::nullopt);
  }
  // Never ten in a row: single errors only.
  const auto apart = EstimateOdometryNoise(gaps);
  EXPECT_NEAR(apart->sigma_rad, 0.01 / std::sqrt(3.0), 1e-9);
  EXPECT_NEAR(apart->sigma_m, 0.1 / std::sqrt(3.0), 1e-9);
  const auto together = EstimateOdometryNoise(whole);
  EXPECT_NEAR(together->sigma_rad, 0.01 * std::sqrt(10.0 / 3.0), 1e-9);
  EXPECT_NEAR(together->sigma_m, 0.1 * std::sqrt(10.0 / 3.0), 1e-9);
}

TEST(OdometryNoiseTest, JumpsAreNoNoise) {
  Errors errors = Draw(200, 0.004, 0.03, Vector6d::Zero());
  const auto without = EstimateOdometryNoise(errors);
  ASSERT_TRUE(without.has_value());
  for (const std::size_t k : {40U, 90U, 91U, 170U}) {
    Vector6d jump = Vector6d::Zero();
    jump[2] = k == 170 ? 0.3 : 0.0;
    jump[3] = k == 170 ? 0.0 : 2.0;
    errors[k] = *errors[k] * Retract(Pose::Identity(), jump);
    EXPECT_TRUE(IsJump(*errors[k], *without)) << k;
  }
  const auto noise = EstimateOdometryNoise(errors);
  ASSERT_TRUE(noise.has_value());
  EXPECT_NEAR(noise->sigma_rad, without->sigma_rad, 0.1 * without->sigma_rad);
  EXPECT_NEAR(noise->sigma_m, without->sigma_m, 0.1 * without->sigma_m);
  for (std::size_t k = 0; k < 40; ++k) EXPECT_FALSE(IsJump(*errors[k], *noise)) << k;
}

// Twenty centimetres of one who errs by millimetres are unusual, and no restart.
TEST(OdometryNoiseTest, WhatIsSmallIsNoJump) {
  EXPECT_FALSE(IsJump(MakePose(Eigen::Quaterniond::Identity(), {0.2, 0.0, 0.0}), {1e-4, 1e-3}));
  EXPECT_TRUE(IsJump(MakePose(Eigen::Quaterniond::Identity(), {0.4, 0.0, 0.0}), {1e-4, 1e-3}));
  EXPECT_FALSE(IsJump(MakePose(Eigen::Quaterniond::Identity(), {0.4, 0.0, 0.0}), {1e-4, 0.1}));
}

TEST(OdometryNoiseTest, NobodyIsPerfect) {
  const auto noise = EstimateOdometryNoise(Draw(100, 0.0, 0.0, Vector6d::Zero()));
  ASSERT_TRUE(noise.has_value());
  EXPECT_GT(noise->sigma_rad, 0.0);
  EXPECT_GT(noise->sigma_m, 0.0);
}

}  // namespace
}  // namespace strata
