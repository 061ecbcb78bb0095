#include "core/posegraph/solver/robust_minimum.h"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/posegraph/pose_graph.h"
#include "core/posegraph/solver/optimize_pose_graph.h"
#include "tests/core/posegraph/random_poses.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

constexpr double kTurnSigma = 0.004;  // of odometry and closures, rad
constexpr double kShiftSigma = 0.03;  // m

// A robot that goes round a block of houses several times: 60 poses a round, 3 m apart, with
// closures between rounds.
class PlantedClosuresTest : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  static constexpr std::size_t kNodes = 240;
  static constexpr std::size_t kRound = 60;

  void SetUp() override {
    for (std::size_t n = 0; n < kNodes; ++n) {
      const double angle = 2.0 * M_PI * static_cast<double>(n) / kRound;
      const double lane = 30.0 + 0.5 * static_cast<double>(n / kRound);
      truth_.push_back(MakePose(
          Eigen::Quaterniond(Eigen::AngleAxisd(angle + M_PI / 2, Eigen::Vector3d::UnitZ())),
          {lane * std::cos(angle), lane * std::sin(angle), 0.2 * std::sin(3.0 * angle)}));
    }
    problem_.T_map_scan.push_back(truth_[0]);
    for (std::size_t n = 1; n < kNodes; ++n) {
      AddTerm(n - 1, n, Measured(n - 1, n), false);
      problem_.T_map_scan.push_back(problem_.T_map_scan.back() * problem_.relative.back().T_i_j);
    }
    for (std::size_t n = kRound; n < kNodes; n += 3) {
      const std::size_t before = n - kRound + random_.Below(3);
      AddTerm(before, n, Measured(before, n), true);
      ++true_closures_;
    }
  }
  Pose Measured(std::size_t i, std::size_t j) {
    return Retract(truth_[i].inverse() * truth_[j], random_.Step(kTurnSigma, kShiftSigma));
  }
  void AddTerm(std::size_t i, std::size_t j, const Pose& T_i_j, bool may_be_false) {
    RelativePoseTerm term{.i = i, .j = j, .T_i_j = T_i_j, .may_be_false = may_be_false};
    Vector6d weights;
    weights << Eigen::Vector3d::Constant(std::pow(kTurnSigma, -2.0)),
        Eigen::Vector3d::Constant(std::pow(kShiftSigma, -2.0));
    term.information = weights.asDiagonal();
    problem_.relative.push_back(term);
  }
  // Closures that say that a place far away is this one.
  void PlantFalse(std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = random_.Below(kNodes);
      const std::size_t j = (i + 10 + random_.Below(kNodes - 20)) % kNodes;
      if ((truth_[i].translation() - truth_[j].translation()).norm() < 10.0) continue;
      false_.insert(problem_.relative.size());
      AddTerm(i, j, Retract(Pose::Identity(), random_.Step(0.3, 1.0)), true);
    }
  }
  double Error(const std::vector<Pose>& T_map_scan) const {
    double sum = 0.0;
    for (std::size_t n = 0; n < kNodes; ++n) {
      sum += (T_map_scan[n].translation() - truth_[n].translation()).squaredNorm();
    }
    return std::sqrt(sum / kNodes);
  }

  testing::RandomPoses random_{GetParam()};
  std::vector<Pose> truth_;
  PoseGraphProblem problem_;
  std::size_t true_closures_ = 0;
  std::set<std::size_t> false_;
};

TEST_P(PlantedClosuresTest, AFifthOfFalseClosuresIsFoundOut) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto clean, OptimizePoseGraph(problem_));
  EXPECT_LE(clean.summary.rejected_relative.size(), 2U);
  PlantFalse(true_closures_ / 4 + 3);
  ASSERT_GE(static_cast<double>(false_.size()), 0.2 * static_cast<double>(true_closures_));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto robust, OptimizePoseGraph(problem_));
  PoseGraphOptions trusting;
  trusting.max_closure_chi2 = std::numeric_limits<double>::infinity();
  STRATA_ASSERT_OK_AND_ASSIGN(const auto naive, OptimizePoseGraph(problem_, trusting));

  std::set<std::size_t> rejected;
  for (const RejectedTerm& term : robust.summary.rejected_relative) rejected.insert(term.term);
  for (const std::size_t term : false_) EXPECT_EQ(rejected.count(term), 1U) << term;
  EXPECT_LE(rejected.size(), false_.size() + 2);
  EXPECT_LE(Error(robust.T_map_scan), 1.5 * Error(clean.T_map_scan));
  EXPECT_GT(Error(naive.T_map_scan), 5.0 * Error(clean.T_map_scan));
  EXPECT_THAT(naive.summary.rejected_relative, ::testing::IsEmpty());
  RecordProperty("iterations", robust.summary.iterations);
  std::printf(
      "seed %d: error %.3f m, odometry %.3f, 20%% false %.3f (all believed %.3f), %d iterations\n",
      static_cast<int>(GetParam()),
      Error(clean.T_map_scan),
      Error(problem_.T_map_scan),
      Error(robust.T_map_scan),
      Error(naive.T_map_scan),
      robust.summary.iterations);
}

TEST_P(PlantedClosuresTest, WhatWasDecidedBeforeStandsWhereItFits) {
  PlantFalse(true_closures_ / 4 + 3);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto anew, OptimizePoseGraph(problem_));
  std::set<std::size_t> rejected;
  for (const RejectedTerm& term : anew.summary.rejected_relative) rejected.insert(term.term);
  for (std::size_t k = 0; k < problem_.relative.size(); ++k) {
    if (problem_.relative[k].may_be_false) problem_.relative[k].believed = !rejected.contains(k);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto again, OptimizePoseGraph(problem_));
  EXPECT_LT(again.summary.iterations, anew.summary.iterations);
  EXPECT_NEAR(Error(again.T_map_scan), Error(anew.T_map_scan), 1e-4);
  EXPECT_EQ(again.summary.rejected_relative.size(), rejected.size());

  problem_.relative[*false_.begin()].believed = true;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto decided, OptimizePoseGraph(problem_));
  EXPECT_GT(decided.summary.iterations, again.summary.iterations);
  EXPECT_NEAR(Error(decided.T_map_scan), Error(anew.T_map_scan), 1e-2);
  EXPECT_EQ(decided.summary.rejected_relative.size(), rejected.size());
}

TEST_P(PlantedClosuresTest, HalfOfThemFalseIsFoundOut) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto clean, OptimizePoseGraph(problem_));
  PlantFalse(true_closures_);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto robust, OptimizePoseGraph(problem_));
  EXPECT_LE(Error(robust.T_map_scan), 1.5 * Error(clean.T_map_scan));
}

TEST_P(PlantedClosuresTest, TwoRobotsThatOnlyClosuresJoinEndInOneWorld) {
  PlantFalse(true_closures_ / 4);
  // The second robot starts after half of the way and takes its start for the origin.
  constexpr std::size_t kSecond = kNodes / 2;
  auto& relative = problem_.relative;
  ASSERT_EQ(relative[kSecond - 1].j, kSecond);
  relative.erase(relative.begin() + kSecond - 1);
  const Pose origin = problem_.T_map_scan[kSecond].inverse();
  for (std::size_t n = kSecond; n < kNodes; ++n) {
    problem_.T_map_scan[n] = Normalized(origin * problem_.T_map_scan[n]);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
  EXPECT_THAT(solution.summary.held, ::testing::ElementsAre(0));
  std::size_t rejected_false = 0;
  for (const RejectedTerm& term : solution.summary.rejected_relative) {
    rejected_false += false_.count(term.term + 1);  // one odometry term is gone
  }
  EXPECT_EQ(rejected_false, false_.size());
  EXPECT_LE(solution.summary.rejected_relative.size(), false_.size() + 2);
  EXPECT_LT(Error(solution.T_map_scan), 1.5);
}

INSTANTIATE_TEST_SUITE_P(Seeds, PlantedClosuresTest, ::testing::Values(1, 2, 3));

TEST(TruncatedWeightTest, GoesFromConvexToTruncated) {
  EXPECT_EQ(TruncatedWeight(9.0, 10.0, 1e6), 1.0);
  EXPECT_EQ(TruncatedWeight(11.0, 10.0, 1e6), 0.0);
  EXPECT_GT(TruncatedWeight(1000.0, 10.0, 0.005), 0.0);
  double last = 1.0;
  for (double chi2 = 0.0; chi2 < 50.0; chi2 += 0.1) {
    const double weight = TruncatedWeight(chi2, 10.0, 0.5);
    EXPECT_LE(weight, last);
    EXPECT_LE(last - weight, 0.05);  // without jumps
    last = weight;
  }
}

}  // namespace
}  // namespace strata
