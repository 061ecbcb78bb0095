#include "core/geometry/euler.h"

#include <cmath>

#include <Eigen/Geometry>

namespace strata {
namespace {

constexpr double kGimbalCosine = 1e-9;

}  // namespace

Eigen::Quaterniond QuaternionOf(const EulerAngles& euler) {
  return Eigen::AngleAxisd(euler.yaw_rad, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(euler.pitch_rad, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(euler.roll_rad, Eigen::Vector3d::UnitX());
}

Eigen::Matrix3d MatrixOf(const EulerAngles& euler) {
  return QuaternionOf(euler).toRotationMatrix();
}

EulerAngles EulerOf(const Eigen::Matrix3d& R) {
  const double cos_pitch = std::hypot(R(0, 0), R(1, 0));
  EulerAngles euler;
  euler.pitch_rad = std::atan2(-R(2, 0), cos_pitch);
  if (cos_pitch < kGimbalCosine) {
    euler.yaw_rad = std::atan2(-R(0, 1), R(1, 1));
    return euler;
  }
  euler.yaw_rad = std::atan2(R(1, 0), R(0, 0));
  // The second and third column of Rz(−yaw)·R hold roll undivided by cos(pitch): exact near the
  // lock.
  const double s = std::sin(euler.yaw_rad);
  const double c = std::cos(euler.yaw_rad);
  euler.roll_rad = std::atan2(s * R(0, 2) - c * R(1, 2), c * R(1, 1) - s * R(0, 1));
  return euler;
}

}  // namespace strata
