#include "core/egomotion/inertial_motion.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/core/egomotion/drawn_state.h"
#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

constexpr double kReadingStep = 1e-5;

class InertialMotionTest : public ::testing::Test {
 protected:
  void Draw() {
    state_ = testing::DrawState(random_);
    mount_ = Eigen::Quaterniond(So3Exp(testing::DrawVector(random_, 1.5)));
    reading_.angular_rate_rad_s = testing::DrawVector(random_, 2.0);
    reading_.specific_force_m_s2 = testing::DrawVector(random_, 15.0);
  }
  FusedState Moved(const FusedState& state, const ImuSample& reading) const {
    return Move(state, mount_, ImuModel(), reading, kDuration).state;
  }

  static constexpr double kDuration = 0.1;
  testing::Random random_{21};
  FusedState state_;
  Eigen::Quaterniond mount_;
  ImuSample reading_;
};

TEST_F(InertialMotionTest, DerivativesByTheState) {
  for (int i = 0; i < 10; ++i) {
    Draw();
    const InertialStep step = Move(state_, mount_, ImuModel(), reading_, kDuration);
    for (int k = 0; k < kStateSize; ++k) {
      const StateVector error = kReadingStep * StateVector::Unit(k);
      const StateVector column =
          (Difference(step.state, Moved(Retract(state_, error), reading_)) -
           Difference(step.state, Moved(Retract(state_, -error), reading_))) /
          (2.0 * kReadingStep);
      EXPECT_LT((step.F.col(k) - column).norm(), 1e-7) << k;
    }
  }
}

// Noise of a reading in the body's axes is noise in the unit's, turned.
TEST_F(InertialMotionTest, DerivativesByTheNoise) {
  for (int i = 0; i < 10; ++i) {
    Draw();
    const InertialStep step = Move(state_, mount_, ImuModel(), reading_, kDuration);
    const Eigen::Quaterniond mount =
        Eigen::AngleAxisd(state_.yaw_mount_rad, Eigen::Vector3d::UnitZ()) * mount_;
    for (int k = 0; k < 6; ++k) {
      const Eigen::Vector3d noise =
          mount.conjugate() * (kReadingStep * Eigen::Vector3d::Unit(k % 3));
      ImuSample more = reading_, less = reading_;
      (k < 3 ? more.angular_rate_rad_s : more.specific_force_m_s2) += noise;
      (k < 3 ? less.angular_rate_rad_s : less.specific_force_m_s2) -= noise;
      const StateVector column = (Difference(step.state, Moved(state_, more)) -
                                  Difference(step.state, Moved(state_, less))) /
                                 (2.0 * kReadingStep);
      EXPECT_LT((step.G.col(k) - column).norm(), 1e-7) << k;
    }
  }
}

TEST_F(InertialMotionTest, StandsUnderItsOwnWeight) {
  FusedState state;
  state.R_map_body = Eigen::Quaterniond(So3Exp({0.2, -0.1, 0.7}));
  ImuSample reading;
  reading.specific_force_m_s2 =
      state.R_map_body.conjugate() * (kGravityM_s2 * Eigen::Vector3d::UnitZ());
  const InertialStep step = Move(state, Eigen::Quaterniond::Identity(), ImuModel(), reading, 1.0);
  EXPECT_LT(step.state.v_imu_m_s.norm(), 1e-12);
  EXPECT_LT(step.state.p_imu_m.norm(), 1e-12);
}

}  // namespace
}  // namespace strata
