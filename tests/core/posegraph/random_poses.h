// Seeded poses, points and derivatives by differences.
#ifndef STRATA_TESTS_CORE_POSEGRAPH_RANDOM_POSES_H_
#define STRATA_TESTS_CORE_POSEGRAPH_RANDOM_POSES_H_

#include <cstdint>
#include <random>

#include <Eigen/Geometry>

#include "core/geometry/pose.h"

namespace strata::testing {

class RandomPoses {
 public:
  explicit RandomPoses(std::uint64_t seed) : random_(seed) {}

  double Normal(double sigma = 1.0) { return sigma * normal_(random_); }
  Eigen::Vector3d Vector(double sigma) { return {Normal(sigma), Normal(sigma), Normal(sigma)}; }
  Vector6d Step(double sigma_rad, double sigma_m) {
    Vector6d step;
    step << Vector(sigma_rad), Vector(sigma_m);
    return step;
  }
  Pose AnyPose(double sigma_m = 5.0) {
    const Eigen::Vector4d q(Normal(), Normal(), Normal(), Normal());
    return MakePose(Eigen::Quaterniond(q).normalized(), Vector(sigma_m));
  }
  Matrix6d Information() {
    Matrix6d A;
    for (int i = 0; i < 36; ++i) A.data()[i] = Normal();
    return A * A.transpose() + Matrix6d::Identity();
  }
  std::size_t Below(std::size_t bound) { return random_() % bound; }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

// Central differences of `function`(step) about the zero step of `size` numbers.
template <typename Function>
Eigen::MatrixXd NumericJacobian(const Function& function, int size) {
  constexpr double kStep = 1e-6;
  Eigen::MatrixXd J;
  for (int k = 0; k < size; ++k) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(size, k);
    const Eigen::VectorXd column = (function(step) - function(-step)) / (2.0 * kStep);
    if (J.size() == 0) J.resize(column.size(), size);
    J.col(k) = column;
  }
  return J;
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_POSEGRAPH_RANDOM_POSES_H_
