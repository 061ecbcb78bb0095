#include "core/posegraph/costs/point_pairs_cost.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "core/registration/umeyama.h"
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
    EXPECT_NEAR(PointPairsCost(pairs, T_i, T_j), brute, 1e-10 * brute);
  }
  const double brute = BruteForce(T_i_, T_j_);
  EXPECT_NEAR(PointPairsCost(pairs, T_i_, T_j_), brute, 1e-9 * brute);
}

TEST_P(PointPairsCostTest, DerivativesAreThoseOfAllPairs) {
  const PointPairsDerivatives d = DifferentiatePointPairs(SummarisePairs(moments_), T_i_, T_j_);
  const Eigen::MatrixXd J_i = testing::NumericJacobian(
      [&](const Eigen::VectorXd& step) { return Residuals(Retract(T_i_, step), T_j_); }, 6);
  const Eigen::MatrixXd J_j = testing::NumericJacobian(
      [&](const Eigen::VectorXd& step) { return Residuals(T_i_, Retract(T_j_, step)); }, 6);
  const Eigen::VectorXd e = Residuals(T_i_, T_j_);
  const double scale = d.ii.cwiseAbs().maxCoeff();
  EXPECT_LT((J_i.transpose() * J_i - d.ii).cwiseAbs().maxCoeff(), 1e-7 * scale);
  EXPECT_LT((J_i.transpose() * J_j - d.ij).cwiseAbs().maxCoeff(), 1e-7 * scale);
  EXPECT_LT((J_j.transpose() * J_j - d.jj).cwiseAbs().maxCoeff(), 1e-7 * scale);
  EXPECT_LT((J_i.transpose() * e - d.gradient_i).cwiseAbs().maxCoeff(), 1e-7 * scale);
  EXPECT_LT((J_j.transpose() * e - d.gradient_j).cwiseAbs().maxCoeff(), 1e-7 * scale);
}

TEST_P(PointPairsCostTest, TheLeastCostIsUmeyamas) {
  const PointPairs pairs = SummarisePairs(moments_);
  const Pose T_i_j = FitRigidTransform(b_, a_, w_).T_y_x;
  const double least = BruteForce(Pose::Identity(), T_i_j);
  EXPECT_NEAR(pairs.least, least, 1e-9 * least);
}

TEST(PointPairsTest, NoPairsCostNothing) {
  const PointPairs pairs = SummarisePairs(PairMoments::Zero());
  EXPECT_EQ(PointPairsCost(pairs, Pose::Identity(), Pose::Identity()), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, PointPairsCostTest, ::testing::Values(1, 2, 3));

}  // namespace
}  // namespace strata
