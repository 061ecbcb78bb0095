#include "core/egomotion/information_filter.h"

#include <cmath>
#include <cstddef>
#include <numbers>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "tests/core/egomotion/drawn_state.h"
#include "tests/support/simulator/simulated_drive.h"
#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

Rig RigAhead() {
  Rig rig;
  rig.R_body_imu = Eigen::Quaterniond::Identity();
  rig.imu_body_m = {0.2, 0.1, 0.5};
  return rig;
}

StateMatrix FirstCovariance() {
  StateVector sigma;
  sigma << 0.05, 0.05, 0.3, 1.0, 1.0, 1.0, 0.5, 0.5, 0.5, 0.01, 0.01, 0.01, 0.1, 0.1, 0.1, 0.05,
      0.1;
  return sigma.cwiseAbs2().asDiagonal();
}

// The same models, in the covariance form.
class CovarianceFilter {
 public:
  CovarianceFilter(const FusedState& state, const StateMatrix& P, const Rig& rig)
      : state_(state), P_(P), rig_(rig) {}
  void Predict(const ImuSample& reading, double time_s) {
    const InertialStep step =
        Move(state_, *rig_.R_body_imu, rig_.imu, reading, time_s - state_.time_s);
    const Eigen::MatrixXd F = step.F, G = step.G, Q = step.variances.asDiagonal();
    P_ = F * Eigen::MatrixXd(P_ * F.transpose());
    P_ += G * Eigen::MatrixXd(Q * G.transpose());
    state_ = step.state;
    state_.time_s = time_s;
  }
  template <int rows>
  void Add(const StateMeasurement<rows>& m) {
    const Eigen::MatrixXd H = m.H, R = m.covariance, PH = P_ * H.transpose();
    const Eigen::MatrixXd S = H * PH + R;
    const Eigen::MatrixXd K = S.partialPivLu().solve(PH.transpose()).transpose();
    state_ = Retract(state_, K * m.residual);
    const Eigen::MatrixXd kept = StateMatrix::Identity() - K * H;
    P_ = kept * Eigen::MatrixXd(P_ * kept.transpose());
    P_ += K * Eigen::MatrixXd(R * K.transpose());
  }
  const FusedState& state() const { return state_; }
  const Eigen::MatrixXd& P() const { return P_; }

 private:
  FusedState state_;
  Eigen::MatrixXd P_;
  const Rig& rig_;
};

// Errors in units of their σ.
StateVector Scaled(const StateVector& error, const StateMatrix& P) {
  return error.cwiseQuotient(P.diagonal().cwiseSqrt());
}

TEST(InformationFilterTest, EqualsTheCovarianceForm) {
  testing::DriveOptions options;
  options.rig = RigAhead();
  options.seconds = 30.0;
  const MotionLog log = testing::SimulateDrive(options, 41);
  FusedState start;
  start.time_s = log.imu.front().time_s;
  InformationFilter filter(start, FirstCovariance(), options.rig);
  CovarianceFilter other(start, FirstCovariance(), options.rig);
  for (std::size_t i = 1; i < log.imu.size(); ++i) {
    filter.Predict(log.imu[i], log.imu[i].time_s);
    other.Predict(log.imu[i], log.imu[i].time_s);
    if (i % 5 == 0) {
      const double speed = log.wheels[i / 5].speed_m_s;
      const Eigen::Quaterniond& mount = *options.rig.R_body_imu;
      filter.Add(
          MeasureSpeed(filter.state(), options.rig, mount, filter.InBody(log.imu[i]), speed));
      other.Add(MeasureSpeed(
          other.state(), options.rig, mount, InBody(other.state(), mount, log.imu[i]), speed));
    }
    if (i % 25 == 0) {
      const Eigen::Vector3d place = testing::TrueBodyPose(options, log.imu[i].time_s).translation();
      const Eigen::Vector3d sigma(1.0, 1.0, 2.0);
      const StateMeasurement<3> position =
          MeasurePosition(other.state(), options.rig, place, sigma);
      const Eigen::Matrix3d S =
          position.H * other.P() * position.H.transpose() + position.covariance;
      const InformationFilter::Innovation innovation =
          filter.InnovationOf(MeasurePosition(filter.state(), options.rig, place, sigma));
      const double nis = position.residual.dot(S.inverse() * position.residual);
      ASSERT_NEAR(innovation.nis, nis, 1e-8 * (1.0 + nis));
      ASSERT_NEAR(innovation.log_determinant, std::log(S.determinant()), 1e-8);
      filter.Add(MeasurePosition(filter.state(), options.rig, place, sigma));
      other.Add(position);
    }
    const StateVector apart = Scaled(Difference(other.state(), filter.state()), other.P());
    ASSERT_LT(apart.cwiseAbs().maxCoeff(), 1e-9) << i;
    const StateVector roots = other.P().diagonal().cwiseSqrt().cwiseInverse();
    const StateMatrix covariance =
        roots.asDiagonal() * (filter.Covariance() - other.P()) * roots.asDiagonal();
    ASSERT_LT(covariance.cwiseAbs().maxCoeff(), 1e-9) << i;
  }
}

TEST(InformationFilterTest, RelocateTurnsAboutThePivotAndForgetsThePlace) {
  const Rig rig = RigAhead();
  testing::Random random(42);
  const FusedState before = testing::DrawState(random);
  InformationFilter filter(before, FirstCovariance(), rig);
  Relocation relocation;
  relocation.yaw_rad = 0.5 * std::numbers::pi;
  relocation.pivot_m = before.p_imu_m - Eigen::Vector3d(1.0, 0.0, 0.0);
  relocation.target_m = {10.0, 20.0, 3.0};
  relocation.sigma_yaw_rad = 0.2;
  relocation.sigma_m = {0.7, 0.7, 1.5};
  filter.Relocate(relocation);
  EXPECT_LT((filter.state().p_imu_m - Eigen::Vector3d(10.0, 21.0, 3.0)).norm(), 1e-12);
  const Eigen::Vector3d v = before.v_imu_m_s;
  EXPECT_LT((filter.state().v_imu_m_s - Eigen::Vector3d(-v.y(), v.x(), v.z())).norm(), 1e-12);
  const StateMatrix P = filter.Covariance();
  EXPECT_NEAR(P(kPosition, kPosition), 0.49, 1e-9);
  EXPECT_NEAR(P(kPosition, kVelocity), 0.0, 1e-9);
  const Eigen::Vector3d up = filter.state().R_map_body.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d rotation = FirstCovariance().topLeftCorner<3, 3>();
  EXPECT_NEAR(up.dot(P.topLeftCorner<3, 3>() * up), up.dot(rotation * up) + 0.04, 1e-9);
}

}  // namespace
}  // namespace strata
