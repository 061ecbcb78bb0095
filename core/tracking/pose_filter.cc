#include "core/tracking/pose_filter.h"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "core/geometry/skew.h"

namespace strata {
namespace {

// Less is known of a direction than σ of 30 m or rad: nothing.
constexpr double kLeastInformation = 1e-3;

// The part of a measurement's information that is not zero: H = Vᵀ, its rows the eigenvectors, and
// the covariance along them.
struct KnownDirections {
  Eigen::MatrixXd H;
  Eigen::MatrixXd covariance;
};

KnownDirections KnownOf(const Matrix6d& information) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(information);
  int unknown = 0;
  while (unknown < 6 && eigen.eigenvalues()[unknown] < kLeastInformation) ++unknown;
  const int known = 6 - unknown;
  return {eigen.eigenvectors().rightCols(known).transpose(),
          Eigen::MatrixXd(eigen.eigenvalues().tail(known).cwiseInverse().asDiagonal())};
}

// The step with Retract(a, step) = b.
Vector6d StepBetween(const Pose& a, const Pose& b) {
  const Pose T_a_b = a.inverse() * b;
  Vector6d step;
  step << So3Log(T_a_b.linear()), T_a_b.translation();
  return step;
}

// T · Retract(I, δ) · U = T · U · Retract(I, A δ) to first order.
Matrix6d AdjointOfInverse(const Pose& U) {
  const Eigen::Matrix3d R_inverse = U.linear().transpose();
  Matrix6d A = Matrix6d::Zero();
  A.topLeftCorner<3, 3>() = R_inverse;
  A.bottomRightCorner<3, 3>() = R_inverse;
  A.bottomLeftCorner<3, 3>() = -R_inverse * Skew(U.translation());
  return A;
}

}  // namespace

Matrix6d MotionCovariance(const Pose& motion) {
  const double way_m = motion.translation().norm();
  const double sigma_m = 0.02 + 0.05 * way_m;
  const double sigma_rad = 0.005 + 0.02 * RotationAngleRad(motion) + 0.005 * way_m;
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(sigma_rad * sigma_rad),
      Eigen::Vector3d::Constant(sigma_m * sigma_m);
  return variances.asDiagonal();
}

void PoseFilter::Predict(const Pose& motion, const Matrix6d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(covariance);
  form_.Predict(AdjointOfInverse(motion), eigen.eigenvectors(), eigen.eigenvalues());
  T_ = Normalized(T_ * motion);
}

double PoseFilter::InnovationOf(const Pose& measured, const Matrix6d& information) const {
  const KnownDirections known = KnownOf(information);
  if (known.H.rows() == 0) return 0.0;
  return form_.InnovationOf(known.H, known.H * StepBetween(T_, measured), known.covariance).nis;
}

void PoseFilter::Update(const Pose& measured, const Matrix6d& information) {
  const KnownDirections known = KnownOf(information);
  if (known.H.rows() == 0) return;
  form_.Add(known.H, known.H * StepBetween(T_, measured), known.covariance);
  T_ = Normalized(Retract(T_, form_.Correct()));
}

}  // namespace strata
