#include "core/egomotion/smoothing/log_nodes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/pose.h"

namespace strata {
namespace {

constexpr double kMaxWheelGapS = 0.5;
constexpr double kStandsM_s = 0.005;
// σ of one sample of wheels that stand, as in MeasureRest().
constexpr double kStandingM_s = 0.02;
constexpr double kStandingRad_s = 0.005;

// Between two wheel samples that are near enough.
struct WheelState {
  double speed_m_s = 0.0;
  std::optional<double> yaw_rate_rad_s;
  double period_s = 0.0;  // between the samples
};

std::optional<WheelState> WheelsAt(const std::vector<WheelSample>& wheels, double time_s) {
  const auto after = std::lower_bound(
      wheels.begin(), wheels.end(), time_s, [](const WheelSample& sample, double time) {
        return sample.time_s < time;
      });
  if (after == wheels.begin() || after == wheels.end()) return std::nullopt;
  const auto before = after - 1;
  const double period_s = after->time_s - before->time_s;
  if (period_s > kMaxWheelGapS) return std::nullopt;
  const double share = (time_s - before->time_s) / period_s;
  WheelState state;
  state.period_s = period_s;
  state.speed_m_s = before->speed_m_s + share * (after->speed_m_s - before->speed_m_s);
  if (before->yaw_rate_rad_s.has_value() && after->yaw_rate_rad_s.has_value()) {
    state.yaw_rate_rad_s =
        *before->yaw_rate_rad_s + share * (*after->yaw_rate_rad_s - *before->yaw_rate_rad_s);
  }
  return state;
}

}  // namespace

std::vector<std::size_t> NodesOf(const std::vector<ImuSample>& imu, double spacing_s) {
  std::vector<std::size_t> nodes = {0};
  for (std::size_t i = 1; i + 1 < imu.size(); ++i) {
    if (imu[i].time_s - imu[nodes.back()].time_s >= spacing_s - 1e-6) nodes.push_back(i);
  }
  nodes.push_back(imu.size() - 1);
  return nodes;
}

InertialDelta DeltaBetween(const std::vector<ImuSample>& imu,
                           const ImuModel& model,
                           std::size_t begin,
                           double until_s,
                           const InertialDelta& start) {
  InertialDelta delta = start;
  for (std::size_t i = begin; i + 1 < imu.size(); ++i) {
    const double end_s = std::min(imu[i + 1].time_s, until_s);
    if (end_s <= imu[i].time_s) break;
    Append(delta,
           model,
           0.5 * (imu[i].angular_rate_rad_s + imu[i + 1].angular_rate_rad_s),
           0.5 * (imu[i].specific_force_m_s2 + imu[i + 1].specific_force_m_s2),
           end_s - imu[i].time_s);
  }
  return delta;
}

std::optional<WheelDelta> WheelsBetween(const std::vector<ImuSample>& imu,
                                        const std::vector<WheelSample>& wheels,
                                        const WheelModel& model,
                                        const Eigen::Quaterniond& R_body_imu,
                                        const Eigen::Vector3d& gyro_bias_rad_s,
                                        std::size_t begin,
                                        std::size_t end) {
  WheelDelta delta;
  delta.has_yaw = true;
  Eigen::Vector4d variance = Eigen::Vector4d::Zero();
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  bool stands = true;
  for (std::size_t i = begin; i < end; ++i) {
    const double dt = imu[i + 1].time_s - imu[i].time_s;
    const std::optional<WheelState> state = WheelsAt(wheels, imu[i].time_s + 0.5 * dt);
    if (!state.has_value()) return std::nullopt;
    const Eigen::Vector3d rate =
        R_body_imu *
        (0.5 * (imu[i].angular_rate_rad_s + imu[i + 1].angular_rate_rad_s) - gyro_bias_rad_s);
    const Eigen::Quaterniond half(So3Exp(0.5 * dt * rate));
    delta.way_m += (turn * half) * Eigen::Vector3d(state->speed_m_s * dt, 0.0, 0.0);
    turn = (turn * half * half).normalized();
    const double yaw_rate = state->yaw_rate_rad_s.value_or(0.0);
    delta.has_yaw = delta.has_yaw && state->yaw_rate_rad_s.has_value();
    delta.yaw_rad += yaw_rate * dt;
    stands = stands && std::abs(state->speed_m_s) < kStandsM_s;
    // Samples are independent, and each counts for its period.
    const double yaw_sigma = model.yaw_rate_rad_s + model.yaw_rate_share * std::abs(yaw_rate);
    variance += dt * state->period_s *
                Eigen::Vector4d(model.speed_m_s, model.side_slip_m_s, model.climb_m_s, yaw_sigma)
                    .cwiseAbs2();
  }
  delta.sigma = variance.cwiseSqrt();
  if (stands) {
    const Eigen::Vector4d standing(kStandingM_s, kStandingM_s, kStandingM_s, kStandingRad_s);
    delta.sigma = delta.sigma.cwiseMin((imu[end].time_s - imu[begin].time_s) * standing);
  }
  return delta;
}

}  // namespace strata
