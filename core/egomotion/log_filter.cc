#include "core/egomotion/log_filter.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace strata {
namespace {

constexpr double kRecordEveryS = 0.05;
// While the start is uncertain, only what no start explains is left out.
constexpr double kStartNis = 50.0;
// A robot stands whose wheels stand for so long and whose gyroscope agrees.
constexpr double kStandsSpeedM_s = 0.005;
constexpr double kStandsRateRad_s = 0.05;
constexpr double kStandsAfterS = 0.5;

double HeadingOf(const Eigen::Quaterniond& R) {
  const Eigen::Vector3d ahead = R * Eigen::Vector3d::UnitX();
  return std::atan2(ahead.y(), ahead.x());
}

// Of an innovation: with so much more on the measurement's own, its NIS is as much smaller.
double VarianceOf(const InformationFilter& filter, const StateMeasurement<1>& measurement) {
  return std::exp(filter.InnovationOf(measurement).log_determinant);
}

// Rows of a position.
template <int rows>
StateMeasurement<rows> PartOf(const StateMeasurement<3>& position, int first) {
  return {position.residual.segment<rows>(first),
          position.H.middleRows<rows>(first),
          position.covariance.block<rows, rows>(first, first)};
}

}  // namespace

LogFilter::LogFilter(const MapLog& log, const Rig& rig, const FilterStart& start)
    : log_(&log),
      rig_(&rig),
      filter_(start.state, start.covariance, rig),
      stands_since_s_(std::numeric_limits<double>::infinity()) {
  const auto later = [&](const auto& sample) { return sample.time_s < start.state.time_s; };
  while (next_wheel_ < log.wheels.size() && later(log.wheels[next_wheel_])) ++next_wheel_;
  while (next_fix_ < log.fixes.size() && later(log.fixes[next_fix_])) ++next_fix_;
  Record(true);
}

ImuSample LogFilter::Reading() const {
  const ImuSample& before = log_->imu[next_imu_ - 1];
  const ImuSample& after = log_->imu[next_imu_];
  return {filter_.state().time_s,
          0.5 * (before.angular_rate_rad_s + after.angular_rate_rad_s),
          0.5 * (before.specific_force_m_s2 + after.specific_force_m_s2)};
}

void LogFilter::PredictTo(double time_s) {
  const FusedState before = filter_.state();
  filter_.Predict(Reading(), time_s);
  distance_m_ += (filter_.state().p_imu_m - before.p_imu_m).norm();
  turned_rad_ += std::remainder(
      HeadingOf(filter_.state().R_map_body) - HeadingOf(before.R_map_body), 2.0 * std::numbers::pi);
}

double LogFilter::HeadingAtStart() const {
  return std::remainder(HeadingOf(filter_.state().R_map_body) - turned_rad_,
                        2.0 * std::numbers::pi);
}

void LogFilter::Step() {
  const double until_s = log_->imu[next_imu_].time_s;
  while (true) {
    const double wheel_s = next_wheel_ < log_->wheels.size()
                               ? log_->wheels[next_wheel_].time_s
                               : std::numeric_limits<double>::infinity();
    const double fix_s = next_fix_ < log_->fixes.size() ? log_->fixes[next_fix_].time_s
                                                        : std::numeric_limits<double>::infinity();
    if (std::min(wheel_s, fix_s) > until_s) break;
    PredictTo(std::min(wheel_s, fix_s));
    if (wheel_s <= fix_s) {
      OnWheels(log_->wheels[next_wheel_++]);
    } else {
      OnFix(log_->fixes[next_fix_++]);
    }
  }
  PredictTo(until_s);
  ++next_imu_;
  Record(false);
}

void LogFilter::OnWheels(const WheelSample& sample) {
  const Eigen::Quaterniond& mount = *rig_->R_body_imu;
  const BodyReading body = filter_.InBody(Reading());
  const bool stands = std::abs(sample.speed_m_s) < kStandsSpeedM_s &&
                      body.angular_rate_rad_s.norm() < kStandsRateRad_s;
  if (!stands) stands_since_s_ = std::numeric_limits<double>::infinity();
  stands_since_s_ = std::min(stands_since_s_, stands ? sample.time_s : stands_since_s_);
  if (sample.time_s - stands_since_s_ >= kStandsAfterS) {
    filter_.Add(MeasureRest(filter_.state(), mount, body));
    return;
  }
  filter_.Add(MeasureSpeed(filter_.state(), *rig_, mount, body, sample.speed_m_s));
  if (!sample.yaw_rate_rad_s.has_value()) return;
  filter_.Add(MeasureYawRate(
      filter_.state(), *rig_, mount, filter_.InBody(Reading()), *sample.yaw_rate_rad_s));
}

void LogFilter::OnFix(const MapFix& fix) {
  const StateMeasurement<3> position =
      MeasurePosition(filter_.state(), *rig_, fix.antenna_m, fix.sigma_m);
  const StateMeasurement<2> place = PartOf<2>(position, 0);
  const InformationFilter::Innovation innovation = filter_.InnovationOf(place);
  FixOutcome outcome;
  outcome.time_s = fix.time_s;
  outcome.antenna_m = fix.antenna_m;
  outcome.sigma_m = position.covariance.diagonal().cwiseSqrt();
  outcome.innovation_m = position.residual;
  outcome.horizontal_nis = innovation.nis;
  outcome.used = innovation.nis <= (settled_ ? kGpsGateNis : kStartNis);
  fixes_.push_back(outcome);
  log_likelihood_ -= 0.5 * (std::min(innovation.nis, kStartNis) + innovation.log_determinant);
  if (!outcome.used) return OnRejected(fix, position);
  gate_.Accept();
  filter_.Add(place);
  StateMeasurement<1> altitude =
      PartOf<1>(MeasurePosition(filter_.state(), *rig_, fix.antenna_m, fix.sigma_m), 2);
  const double excess = filter_.InnovationOf(altitude).nis / kAltitudeNis;
  if (excess > 1.0) altitude.covariance(0) += (excess - 1.0) * VarianceOf(filter_, altitude);
  filter_.Add(altitude);
}

void LogFilter::OnRejected(const MapFix& fix, const StateMeasurement<3>& position) {
  if (!settled_) return;
  const std::optional<Relocation> relocation =
      gate_.Reject({fix.time_s,
                    fix.antenna_m,
                    fix.antenna_m - position.residual,
                    position.covariance.diagonal().cwiseSqrt()});
  if (!relocation.has_value()) return;
  const Eigen::Vector3d before = filter_.state().p_imu_m;
  filter_.Relocate(*relocation);
  recoveries_.push_back(
      {fix.time_s, (filter_.state().p_imu_m - before).norm(), relocation->yaw_rad});
}

void LogFilter::Record(bool always) {
  const FusedState& state = filter_.state();
  if (!poses_.empty()) {
    const double since_s = state.time_s - poses_.back().time_s;
    if (since_s <= 0.0 || (!always && since_s < kRecordEveryS - 1e-6)) return;
  }
  poses_.push_back({state.time_s,
                    BodyPose(state, rig_->imu_body_m),
                    BodyCovariance(state, filter_.Covariance(), rig_->imu_body_m)});
  states_.push_back(state);
}

}  // namespace strata
