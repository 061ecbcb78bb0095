#include "core/egomotion/measurements.h"

#include <functional>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/core/egomotion/drawn_state.h"
#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

constexpr double kErrorStep = 1e-6;

class MeasurementsTest : public ::testing::Test {
 protected:
  // `measure` at ten drawn states: the residual falls as H says.
  template <int rows>
  void ExpectDerivatives(const std::function<StateMeasurement<rows>(const FusedState&)>& measure) {
    for (int i = 0; i < 10; ++i) {
      const FusedState state = testing::DrawState(random_);
      const StateMeasurement<rows> here = measure(state);
      for (int k = 0; k < kStateSize; ++k) {
        const StateVector error = kErrorStep * StateVector::Unit(k);
        const Eigen::Matrix<double, rows, 1> column =
            (measure(Retract(state, -error)).residual - measure(Retract(state, error)).residual) /
            (2.0 * kErrorStep);
        EXPECT_LT((here.H.col(k) - column).norm(), 1e-7) << k;
      }
    }
  }
  BodyReading Body(const FusedState& state) const { return InBody(state, mount_, reading_); }

  MeasurementsTest() {
    rig_.imu_body_m = {0.3, -0.2, 0.8};
    rig_.gps.antenna_body_m = {-0.5, 0.1, 1.4};
  }
  testing::Random random_{31};
  Rig rig_;
  const Eigen::Quaterniond mount_{So3Exp({0.4, -1.0, 0.6})};
  const ImuSample reading_{100.0, {0.3, -0.4, 0.9}, {1.0, 2.0, 9.0}};
};

TEST_F(MeasurementsTest, PositionOfTheAntenna) {
  ExpectDerivatives<3>([this](const FusedState& state) {
    return MeasurePosition(state, rig_, {3.0, -2.0, 1.0}, {0.1, 2.0, 3.0});
  });
  const StateMeasurement<3> m = MeasurePosition(FusedState(), rig_, {}, {0.1, 2.0, 3.0});
  EXPECT_DOUBLE_EQ(m.covariance(0, 0), rig_.gps.least_sigma_m * rig_.gps.least_sigma_m);
  EXPECT_DOUBLE_EQ(m.covariance(1, 1), 4.0);
}

TEST_F(MeasurementsTest, SpeedOfTheWheels) {
  ExpectDerivatives<3>([this](const FusedState& state) {
    return MeasureSpeed(state, rig_, mount_, Body(state), 1.5);
  });
}

TEST_F(MeasurementsTest, SpeedIsThatOfTheBodysOrigin) {
  FusedState state;  // turns on the spot: the IMU moves, the wheels' middle does not
  const BodyReading body = {{0.0, 0.0, 1.0}, {}};
  state.v_imu_m_s = body.angular_rate_rad_s.cross(rig_.imu_body_m);
  const StateMeasurement<3> m =
      MeasureSpeed(state, rig_, Eigen::Quaterniond::Identity(), body, 0.0);
  EXPECT_LT(m.residual.norm(), 1e-12);
}

TEST_F(MeasurementsTest, YawRateOfTheWheels) {
  ExpectDerivatives<1>([this](const FusedState& state) {
    return MeasureYawRate(state, rig_, mount_, Body(state), 0.7);
  });
}

TEST_F(MeasurementsTest, Rest) {
  ExpectDerivatives<6>(
      [this](const FusedState& state) { return MeasureRest(state, mount_, Body(state)); });
}

}  // namespace
}  // namespace strata
