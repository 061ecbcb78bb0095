#include "core/posegraph/costs/plane_cost.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "core/posegraph/costs/pose_block.h"
#include "core/posegraph/solver/manifolds.h"
#include "tests/core/posegraph/cost_jacobian.h"
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
  const Eigen::Vector3d centre = T_.translation();
  const double brute = Distances(T_, plane_).squaredNorm();
  const PlaneBlock block = PlaneBlockOf(plane_, centre);
  EXPECT_NEAR(
      PlaneViewDistances(view, T_, block.data(), centre).squaredNorm(), brute, 1e-10 * brute);
}

TEST_P(PlaneCostTest, DerivativesAreThoseOfAllPoints) {
  const PoseManifold poses;
  const PlaneManifold planes;
  const Eigen::Vector3d centre = T_.translation() + random_.Vector(5.0);
  const PlaneView view = SummariseView(moments_);
  const PlaneViewCost cost(view, centre, 0.3);
  const PoseBlock pose = PoseBlockOf(T_);
  const PlaneBlock block = PlaneBlockOf(plane_, centre);
  const testing::Blocks blocks = {{pose.begin(), pose.end()}, {block.begin(), block.end()}};
  testing::ExpectTrueJacobians(cost, blocks, {&poses, &planes}, 1e-6);

  const std::vector<Eigen::MatrixXd> by = testing::JacobiansOf(cost, blocks, {&poses, &planes});
  const Eigen::MatrixXd J = testing::NumericJacobian(
      [&](const Eigen::VectorXd& step) { return Distances(Retract(T_, step), plane_); }, 6);
  const Eigen::MatrixXd K = testing::NumericJacobian(
      [&](const Eigen::VectorXd& step) {
        PlaneBlock moved = block;
        EXPECT_TRUE(planes.Plus(block.data(), step.data(), moved.data()));
        return Distances(T_, PlaneOf(moved, centre));
      },
      3);
  const Eigen::VectorXd e = Distances(T_, plane_);
  const Eigen::VectorXd r = testing::ResidualsOf(cost, blocks);
  const double scale = J.squaredNorm() + K.squaredNorm();
  EXPECT_LT((0.3 * J.transpose() * J - by[0].transpose() * by[0]).norm(), 1e-6 * scale);
  EXPECT_LT((0.3 * J.transpose() * K - by[0].transpose() * by[1]).norm(), 1e-6 * scale);
  EXPECT_LT((0.3 * K.transpose() * K - by[1].transpose() * by[1]).norm(), 1e-6 * scale);
  EXPECT_LT((0.3 * J.transpose() * e - by[0].transpose() * r).norm(), 1e-6 * scale);
  EXPECT_LT((0.3 * K.transpose() * e - by[1].transpose() * r).norm(), 1e-6 * scale);
}

TEST_P(PlaneCostTest, TheCentreIsNoPartOfThePlane) {
  const Eigen::Vector3d centre = random_.Vector(100.0);
  const Plane back = PlaneOf(PlaneBlockOf(plane_, centre), centre);
  EXPECT_NEAR(back.distance, plane_.distance, 1e-9);
  EXPECT_LT((back.normal - plane_.normal).norm(), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Seeds, PlaneCostTest, ::testing::Values(1, 2, 3));

}  // namespace
}  // namespace strata
