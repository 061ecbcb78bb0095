#include "core/geometry/pose.h"

#include <cmath>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Geometry>

namespace strata {

Pose MakePose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation_m) {
  Pose T = Pose::Identity();
  T.linear() = rotation.normalized().toRotationMatrix();
  T.translation() = translation_m;
  return T;
}

absl::Status ValidatePose(const Pose& pose, double max_translation_m) {
  if (!pose.matrix().allFinite()) return absl::InvalidArgumentError("pose: not finite");
  if (pose.translation().norm() > max_translation_m) {
    return absl::InvalidArgumentError(absl::StrCat("pose: translation of ",
                                                   pose.translation().norm(),
                                                   " m is beyond ",
                                                   max_translation_m,
                                                   " m"));
  }
  const Eigen::Matrix3d R = pose.linear();
  const double skew = (R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (skew > 1e-6 || R.determinant() < 0.0) {
    return absl::InvalidArgumentError(
        absl::StrCat("pose: linear part is no rotation (|R Rᵀ − I| = ", skew, ", bound 1e-6)"));
  }
  return absl::OkStatus();
}

Eigen::Matrix3d So3Exp(const Eigen::Vector3d& rotation_vector_rad) {
  const double angle = rotation_vector_rad.norm();
  if (angle < 1e-12) {
    const Eigen::Quaterniond q(1.0,
                               0.5 * rotation_vector_rad.x(),
                               0.5 * rotation_vector_rad.y(),
                               0.5 * rotation_vector_rad.z());
    return q.normalized().toRotationMatrix();
  }
  return Eigen::AngleAxisd(angle, rotation_vector_rad / angle).toRotationMatrix();
}

Eigen::Vector3d So3Log(const Eigen::Matrix3d& R) {
  Eigen::Quaterniond q(R);
  if (q.w() < 0.0) q.coeffs() *= -1.0;
  const double sine = q.vec().norm();
  if (sine < 1e-12) return 2.0 * q.vec();
  return (2.0 * std::atan2(sine, q.w()) / sine) * q.vec();
}

double RotationAngleRad(const Pose& pose) { return So3Log(pose.linear()).norm(); }

Pose Retract(const Pose& T, const Vector6d& step) {
  Pose delta = Pose::Identity();
  delta.linear() = So3Exp(step.head<3>());
  delta.translation() = step.tail<3>();
  return T * delta;
}

Pose Normalized(const Pose& T) { return MakePose(Eigen::Quaterniond(T.linear()), T.translation()); }

}  // namespace strata
