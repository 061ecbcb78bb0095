#include "core/egomotion/gps_gate.h"

#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/core/egomotion/drawn_state.h"
#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

constexpr double kSigmaM = 0.5;

// A robot that drives a bow at 2 m/s, as its state has it, and fixes that have it turned and moved.
class GpsGateTest : public ::testing::Test {
 protected:
  RejectedFix Fix(double time_s, double yaw_rad, const Eigen::Vector3d& offset) {
    RejectedFix fix;
    fix.time_s = time_s;
    fix.predicted_m = {2.0 * time_s, 0.05 * time_s * time_s, 0.0};
    fix.measured_m =
        Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) * fix.predicted_m + offset;
    for (double& number : fix.measured_m) number += kSigmaM * random_.Gaussian();
    fix.sigma_m.setConstant(kSigmaM);
    return fix;
  }
  testing::Random random_{51};
  GpsGate gate_;
};

TEST_F(GpsGateTest, FixesThatAgreeForLongEnoughMoveTheState) {
  std::optional<Relocation> relocation;
  double time_s = 0.0;
  for (; !relocation.has_value() && time_s < 60.0; time_s += 0.5) {
    relocation = gate_.Reject(Fix(time_s, 0.0, {20.0, -5.0, 0.0}));
  }
  ASSERT_TRUE(relocation.has_value());
  EXPECT_NEAR(time_s, GpsGate::kAgreeingS, 1.0);
  EXPECT_DOUBLE_EQ(relocation->yaw_rad, 0.0);
  EXPECT_LT((relocation->target_m - relocation->pivot_m - Eigen::Vector3d(20, -5, 0)).norm(), 0.6);
}

TEST_F(GpsGateTest, AndTurnItWhereTheWaySaysSo) {
  std::optional<Relocation> relocation;
  for (double time_s = 0.0; !relocation.has_value() && time_s < 60.0; time_s += 0.5) {
    relocation = gate_.Reject(Fix(time_s, 2.0, {20.0, -5.0, 0.0}));
  }
  ASSERT_TRUE(relocation.has_value());
  EXPECT_NEAR(relocation->yaw_rad, 2.0, 4.0 * relocation->sigma_yaw_rad);
  EXPECT_LT(relocation->sigma_yaw_rad, 0.1);
}

TEST_F(GpsGateTest, FixesThatContradictEachOtherMoveNothing) {
  for (double time_s = 0.0; time_s < 60.0; time_s += 0.5) {
    const Eigen::Vector3d offset = testing::DrawVector(random_, 20.0);
    EXPECT_FALSE(gate_.Reject(Fix(time_s, 0.0, offset)).has_value());
  }
}

TEST_F(GpsGateTest, ABeliefInBetweenBeginsAnew) {
  for (double time_s = 0.0; time_s < 60.0; time_s += 0.5) {
    EXPECT_FALSE(gate_.Reject(Fix(time_s, 0.0, {20.0, -5.0, 0.0})).has_value());
    if (static_cast<int>(time_s) % 8 == 7) gate_.Accept();
  }
}

TEST_F(GpsGateTest, AFewFixesAreTooFew) {
  for (double time_s = 0.0; time_s < 60.0; time_s += 4.0) {
    EXPECT_FALSE(gate_.Reject(Fix(time_s, 0.0, {20.0, -5.0, 0.0})).has_value());
  }
}

}  // namespace
}  // namespace strata
