#include "core/posegraph/costs/point_pairs_cost.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "core/posegraph/costs/pose_block.h"
#include "core/posegraph/solver/manifolds.h"
#include "core/registration/umeyama.h"
#include "tests/core/posegraph/cost_jacobian.h"
#include "tests/core/posegraph/random_poses.h"

namespace strata {
namespace {

class PointPairsCostTest : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  void SetUp() override {
    T_i_ = random_.AnyPose();
    T_j_ = random_.AnyPose();
    for (int k = 0; k < 40; ++k) {
      a_.push_back(random_.Vector(10.0) + Eigen::Vector3d(20, 0, 0));
      b_.push_back(T_j_.inverse() * (T_i_ * a_.back() + random_.Vector(0.5)));
      w_.push_back(std::abs(random_.Normal()));
      Eigen::Matrix<double, 8, 1> ab;
      ab << a_.back(), 1.0, b_.back(), 1.0;
      moments_ += w_.back() * ab * ab.transpose();
    }
  }
  double BruteForce(const Pose& T_i, const Pose& T_j) const {
    double cost = 0.0;
    for (std::size_t k = 0; k < a_.size(); ++k) {
      cost += w_[k] * (T_i * a_[k] - T_j * b_[k]).squaredNorm();
    }
    return cost;
  }
  // Every pair's difference in the scan of i, times the square root of its weight.
  Eigen::VectorXd Residuals(const Pose& T_i, const Pose& T_j) const {
    Eigen::VectorXd e(3 * static_cast<Eigen::Index>(a_.size()));
    for (std::size_t k = 0; k < a_.size(); ++k) {
      e.segment<3>(3 * static_cast<Eigen::Index>(k)) =
          std::sqrt(w_[k]) * (a_[k] - T_i.inverse() * (T_j * b_[k]));
    }
    return e;
  }

  testing::RandomPoses random_{GetParam()};
  Pose T_i_, T_j_;
  std::vector<Eigen::Vector3d> a_, b_;
  std::vector<double> w_;
  PairMoments moments_ = PairMoments::Zero();
};

TEST_P(PointPairsCostTest, SevenPairsCostWhatAllCost) {
  const PointPairs pairs = SummarisePairs(moments_);
  for (int n = 0; n < 20; ++n) {
    const Pose T_i = random_.AnyPose();
    const Pose T_j = random_.AnyPose();
    const double brute = BruteForce(T_i, T_j);
    EXPECT_NEAR(PointPairsChi2(pairs, T_i, T_j), brute, 1e-10 * brute);
  }
  const double brute = BruteForce(T_i_, T_j_);
  EXPECT_NEAR(PointPairsChi2(pairs, T_i_, T_j_), brute, 1e-9 * brute);
}

TEST_P(PointPairsCostTest, DerivativesAreThoseOfAllPairs) {
  const PoseManifold manifold;
  const PointPairs pairs = SummarisePairs(moments_);
  const double weight = 0.5;
  const PointPairsCost cost(pairs, 0.6, &weight);
  const PoseBlock i = PoseBlockOf(T_i_);
  const PoseBlock j = PoseBlockOf(T_j_);
  const testing::Blocks blocks = {{i.begin(), i.end()}, {j.begin(), j.end()}};
  testing::ExpectTrueJacobians(cost, blocks, {&manifold, &manifold}, 1e-6);

  const std::vector<Eigen::MatrixXd> by =
      testing::JacobiansOf(cost, blocks, {&manifold, &manifold});
  const Eigen::MatrixXd J_i = testing::NumericJacobian(
      [&](const Eigen::VectorXd& step) { return Residuals(Retract(T_i_, step), T_j_); }, 6);
  const Eigen::MatrixXd J_j = testing::NumericJacobian(
      [&](const Eigen::VectorXd& step) { return Residuals(T_i_, Retract(T_j_, step)); }, 6);
  const Eigen::VectorXd e = Residuals(T_i_, T_j_);
  const Eigen::VectorXd r = testing::ResidualsOf(cost, blocks);
  const double scale = J_i.squaredNorm();
  EXPECT_LT((0.3 * J_i.transpose() * J_i - by[0].transpose() * by[0]).norm(), 1e-7 * scale);
  EXPECT_LT((0.3 * J_i.transpose() * J_j - by[0].transpose() * by[1]).norm(), 1e-7 * scale);
  EXPECT_LT((0.3 * J_j.transpose() * J_j - by[1].transpose() * by[1]).norm(), 1e-7 * scale);
  EXPECT_LT((0.3 * J_i.transpose() * e - by[0].transpose() * r).norm(), 1e-7 * scale);
  EXPECT_LT((0.3 * J_j.transpose() * e - by[1].transpose() * r).norm(), 1e-7 * scale);
}

TEST_P(PointPairsCostTest, TheLeastCostIsUmeyamas) {
  const PointPairs pairs = SummarisePairs(moments_);
  const Pose T_i_j = FitRigidTransform(b_, a_, w_).T_y_x;
  const double least = BruteForce(Pose::Identity(), T_i_j);
  EXPECT_NEAR(pairs.least, least, 1e-9 * least);
}

TEST(PointPairsTest, NoPairsCostNothing) {
  const PointPairs pairs = SummarisePairs(PairMoments::Zero());
  EXPECT_EQ(PointPairsChi2(pairs, Pose::Identity(), Pose::Identity()), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, PointPairsCostTest, ::testing::Values(1, 2, 3));

}  // namespace
}  // namespace strata
