#include "core/posegraph/costs/plane_cost.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "tests/core/posegraph/random_poses.h"

namespace strata {
namespace {

class PlaneCostTest : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  void SetUp() override {
    T_ = random_.AnyPose(100.0);
    plane_ = Plane{.normal = random_.Vector(1.0).normalized(), .distance = random_.Normal(10.0)};
    for (int k = 0; k < 30; ++k) {
      points_.push_back(random_.Vector(8.0));
      w_.push_back(std::abs(random_.Normal()));
      const Eigen::Vector4d p = points_.back().homogeneous();
      moments_ += w_.back() * p * p.transpose();
    }
  }
  Eigen::VectorXd Distances(const Pose& T, const Plane& plane) const {
    Eigen::VectorXd e(static_cast<Eigen::Index>(points_.size()));
    for (std::size_t k = 0; k < points_.size(); ++k) {
      e[static_cast<Eigen::Index>(k)] = std::sqrt(w_[k]) * SignedDistance(T * points_[k], plane);
    }
    return e;
  }

  testing::RandomPoses random_{GetParam()};
  Pose T_;
  Plane plane_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<double> w_;
  PointMoments moments_ = PointMoments::Zero();
};

TEST_P(PlaneCostTest, FourPointsCostWhatAllCost) {
  const PlaneView view = SummariseView(moments_);
  const double brute = Distances(T_, plane_).squaredNorm();
  EXPECT_NEAR(PlaneViewCost(view, T_, MovingPlane(plane_, T_.translation())), brute, 1e-10 * brute);
}

TEST_P(PlaneCostTest, DerivativesAreThoseOfAllPoints) {
  const MovingPlane moving(plane_, T_.translation() + random_.Vector(5.0));
  const PlaneViewDerivatives d = DifferentiatePlaneView(SummariseView(moments_), T_, moving);
  const Eigen::MatrixXd J = testing::NumericJacobian(
      [&](const Eigen::VectorXd& step) { return Distances(Retract(T_, step), plane_); }, 6);
  const Eigen::MatrixXd K = testing::NumericJacobian(
      [&](const Eigen::VectorXd& step) { return Distances(T_, moving.Retracted(step).plane()); },
      3);
  const Eigen::VectorXd e = Distances(T_, plane_);
  const double scale = std::max(d.poses.cwiseAbs().maxCoeff(), d.planes.cwiseAbs().maxCoeff());
  EXPECT_LT((J.transpose() * J - d.poses).cwiseAbs().maxCoeff(), 1e-6 * scale);
  EXPECT_LT((J.transpose() * K - d.mixed).cwiseAbs().maxCoeff(), 1e-6 * scale);
  EXPECT_LT((K.transpose() * K - d.planes).cwiseAbs().maxCoeff(), 1e-6 * scale);
  EXPECT_LT((J.transpose() * e - d.gradient_pose).cwiseAbs().maxCoeff(), 1e-6 * scale);
  EXPECT_LT((K.transpose() * e - d.gradient_plane).cwiseAbs().maxCoeff(), 1e-6 * scale);
}

TEST_P(PlaneCostTest, TheCentreIsNoPartOfThePlane) {
  const MovingPlane moving(plane_, random_.Vector(100.0));
  EXPECT_NEAR(moving.plane().distance, plane_.distance, 1e-9);
  EXPECT_LT((moving.plane().normal - plane_.normal).norm(), 1e-12);
  EXPECT_NEAR(moving.Retracted(random_.Vector(0.3)).plane().normal.norm(), 1.0, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Seeds, PlaneCostTest, ::testing::Values(1, 2, 3));

}  // namespace
}  // namespace strata
