#include "core/egomotion/mounting.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_format.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/rotation_between.h"

namespace strata {
namespace {

constexpr char kCure[] = "; say how the IMU sits with 'imu: orientation' in a rig file (--rig)";
// Over which speeds are compared [s].
constexpr double kWindowS = 1.0;
// Of the accelerations' products that must agree; at random it is near 0.
constexpr double kLeastCorrelation = 0.1;

double SpeedAt(const std::vector<WheelSample>& wheels, double time_s) {
  const auto after = std::lower_bound(
      wheels.begin(), wheels.end(), time_s, [](const WheelSample& sample, double time) {
        return sample.time_s < time;
      });
  if (after == wheels.begin()) return wheels.front().speed_m_s;
  if (after == wheels.end()) return wheels.back().speed_m_s;
  const auto before = after - 1;
  const double share = (time_s - before->time_s) / (after->time_s - before->time_s);
  return before->speed_m_s + share * (after->speed_m_s - before->speed_m_s);
}

Eigen::Vector3d MeanForce(const std::vector<ImuSample>& imu) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : imu) sum += sample.specific_force_m_s2;
  return sum / static_cast<double>(imu.size());
}

// What one window of a log says, in axes that are level but for their yaw.
struct Accelerations {
  Eigen::Vector2d felt = Eigen::Vector2d::Zero();
  Eigen::Vector2d driven = Eigen::Vector2d::Zero();  // forward, left
};

Accelerations Compare(const MotionLog& log,
                      const Rig& rig,
                      const Eigen::Quaterniond& level,
                      std::size_t begin,
                      std::size_t end) {
  Accelerations result;
  double yaw_rate = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    result.felt += (level * log.imu[i].specific_force_m_s2).head<2>();
    yaw_rate += (level * log.imu[i].angular_rate_rad_s).z();
  }
  const auto count = static_cast<double>(end - begin);
  const double t0 = log.imu[begin].time_s + rig.wheels.lag_s;
  const double t1 = log.imu[end].time_s + rig.wheels.lag_s;
  const double before = SpeedAt(log.wheels, t0), after = SpeedAt(log.wheels, t1);
  result.felt /= count;
  result.driven = {(after - before) / (t1 - t0), 0.5 * (before + after) * yaw_rate / count};
  return result;
}

}  // namespace

absl::StatusOr<Eigen::Quaterniond> FindMounting(const MotionLog& log, const Rig& rig) {
  if (log.wheels.size() < 2) {
    return absl::FailedPreconditionError(
        absl::StrFormat("the log has no speeds to tell where the IMU's front is%s", kCure));
  }
  const auto level = RotationBetween(MeanForce(log.imu), Eigen::Vector3d::UnitZ());
  double cross = 0.0, dot = 0.0, felt2 = 0.0, driven2 = 0.0;
  std::size_t begin = 0;
  for (std::size_t i = 1; i < log.imu.size(); ++i) {
    if (log.imu[i].time_s - log.imu[begin].time_s < kWindowS) continue;
    const Accelerations a = Compare(log, rig, level, begin, i);
    cross += a.felt.x() * a.driven.y() - a.felt.y() * a.driven.x();
    dot += a.felt.dot(a.driven);
    felt2 += a.felt.squaredNorm();
    driven2 += a.driven.squaredNorm();
    begin = i;
  }
  const double correlation = std::hypot(cross, dot) / std::sqrt(felt2 * driven2);
  if (!(correlation >= kLeastCorrelation)) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "the robot moved too evenly to tell where the IMU's front is (correlation %.2f, needs "
        "%.2f)%s",
        correlation,
        kLeastCorrelation,
        kCure));
  }
  const Eigen::AngleAxisd yaw(std::atan2(cross, dot), Eigen::Vector3d::UnitZ());
  return (yaw * level).normalized();
}

}  // namespace strata
