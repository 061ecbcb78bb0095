#include "core/posegraph/covariance.h"

#include <cstdint>
#include <numeric>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/posegraph/relative_pose_cost.h"
#include "tests/core/posegraph/random_poses.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

class CovarianceTest : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  void Add(std::size_t i, std::size_t j) {
    problem_.relative.push_back({.i = i,
                                 .j = j,
                                 .T_i_j = problem_.T_map_scan[i].inverse() * problem_.T_map_scan[j],
                                 .information = random_.Information()});
  }
  testing::RandomPoses random_{GetParam()};
  PoseGraphProblem problem_;
};

TEST_P(CovarianceTest, IsTheInverseOfTheWholeInformation) {
  for (int n = 0; n < 15; ++n) problem_.T_map_scan.push_back(random_.AnyPose());
  for (std::size_t n = 1; n < 15; ++n) Add(n - 1, n);
  Add(2, 9);
  Add(12, 4);
  problem_.fixed.assign(15, false);
  problem_.fixed[6] = true;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(90, 90);
  for (const RelativePoseTerm& term : problem_.relative) {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, 90);
    const auto d = DifferentiateRelativePose(
        problem_.T_map_scan[term.i], problem_.T_map_scan[term.j], term.T_i_j);
    J.middleCols<6>(6 * static_cast<Eigen::Index>(term.i)) = d.by_i;
    J.middleCols<6>(6 * static_cast<Eigen::Index>(term.j)) = d.by_j;
    H += J.transpose() * term.information * J;
  }
  H.middleRows<6>(36).setZero();
  H.middleCols<6>(36).setZero();
  H.block<6, 6>(36, 36).setIdentity();
  const Eigen::MatrixXd inverse = H.inverse();

  std::vector<std::size_t> nodes(15);
  std::iota(nodes.begin(), nodes.end(), std::size_t{0});
  STRATA_ASSERT_OK_AND_ASSIGN(const auto covariances, MarginalCovariances(problem_, nodes));
  for (Eigen::Index n = 0; n < 15; ++n) {
    const Matrix6d expected =
        n == 6 ? Matrix6d(Matrix6d::Zero()) : Matrix6d(inverse.block<6, 6>(6 * n, 6 * n));
    EXPECT_LT((covariances[static_cast<std::size_t>(n)] - expected).norm(),
              1e-8 * (1.0 + expected.norm()));
  }
}

TEST_P(CovarianceTest, IsHowFarSampledOptimaSpread) {
  // A chain with a closure, measured again and again.
  for (int n = 0; n < 6; ++n) problem_.T_map_scan.push_back(random_.AnyPose(3.0));
  for (std::size_t n = 1; n < 6; ++n) Add(n - 1, n);
  Add(5, 0);
  for (RelativePoseTerm& term : problem_.relative) term.information *= 1e4;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto covariance, MarginalCovariances(problem_, {3}));
  Matrix6d sampled = Matrix6d::Zero();
  constexpr int kSamples = 1000;
  for (int k = 0; k < kSamples; ++k) {
    PoseGraphProblem noisy = problem_;
    for (RelativePoseTerm& term : noisy.relative) {
      const Matrix6d root = term.information.llt().matrixL().transpose();
      term.T_i_j = Retract(term.T_i_j, root.inverse() * random_.Step(1.0, 1.0));
    }
    STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(noisy));
    const Vector6d step =
        RelativePoseError(problem_.T_map_scan[3], solution.T_map_scan[3], Pose::Identity());
    sampled += step * step.transpose() / kSamples;
  }
  EXPECT_LT((sampled - covariance[0]).norm(), 0.2 * covariance[0].norm());
}

INSTANTIATE_TEST_SUITE_P(Seeds, CovarianceTest, ::testing::Values(1, 2, 3));

TEST(CovarianceErrorsTest, NameWhatIsWrong) {
  PoseGraphProblem problem;
  problem.T_map_scan.assign(2, Pose::Identity());
  problem.relative.push_back({.i = 0, .j = 1});
  STRATA_EXPECT_OK(MarginalCovariances(problem, {0, 1}));
  problem.planes.emplace_back();  // that nobody saw
  STRATA_EXPECT_OK(MarginalCovariances(problem, {0, 1}));
  EXPECT_THAT(MarginalCovariances(problem, {2}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("node 2 of covariance")));
  problem.relative[0].information(5, 5) = 0.0;
  EXPECT_THAT(MarginalCovariances(problem, {1}),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("undetermined")));
}

}  // namespace
}  // namespace strata
