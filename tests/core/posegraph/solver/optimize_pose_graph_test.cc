#include "core/posegraph/solver/optimize_pose_graph.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/posegraph/random_poses.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

double LargestStep(const Pose& a, const Pose& b) {
  const Pose delta = a.inverse() * b;
  return std::max(RotationAngleRad(delta), delta.translation().norm());
}

PointMoments MomentsOf(const std::vector<Eigen::Vector3d>& points, double sigma_m) {
  PointMoments moments = PointMoments::Zero();
  for (const Eigen::Vector3d& p : points) {
    const Eigen::Vector4d homogeneous = p.homogeneous();
    moments += homogeneous * homogeneous.transpose() / (sigma_m * sigma_m);
  }
  return moments;
}

class PoseGraphTest : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  // Truth, and starts that are off; the first is right.
  void MakePoses(std::size_t count, double off_rad, double off_m) {
    for (std::size_t n = 0; n < count; ++n) {
      truth_.push_back(random_.AnyPose(10.0));
      const Vector6d step = random_.Step(off_rad, off_m);
      problem_.T_map_scan.push_back(n == 0 ? truth_[0] : Retract(truth_[n], step));
    }
  }
  void AddRelative(std::size_t i, std::size_t j, double noise = 0.0) {
    problem_.relative.push_back(
        {.i = i,
         .j = j,
         .T_i_j = Retract(truth_[i].inverse() * truth_[j], random_.Step(0.1 * noise, noise)),
         .information = random_.Information() / std::max(noise * noise, 1e-4)});
  }
  // Points of the plane as every pose sees them: spread over it, or along `line` through its
  // middle.
  void AddPlane(const Plane& plane, const Eigen::Vector3d& line = Eigen::Vector3d::Zero()) {
    PlaneTerm term{.plane_map = plane, .views = {}};
    for (std::size_t n = 0; n < truth_.size(); ++n) {
      std::vector<Eigen::Vector3d> points;
      for (int k = 0; k < 20; ++k) {
        Eigen::Vector3d p = random_.Vector(10.0);
        if (!line.isZero()) p = random_.Normal(10.0) * line;
        p -= SignedDistance(p, plane) * plane.normal;
        points.push_back(truth_[n].inverse() * p);
      }
      term.views.push_back({.i = n, .moments = MomentsOf(points, 0.02)});
    }
    problem_.planes.push_back(term);
  }
  // The normal of a surface of each node's own that faces along it, or away.
  void AddDirection(const Eigen::Vector3d& direction) {
    DirectionTerm term{.direction_map = direction, .views = {}};
    for (std::size_t n = 0; n < truth_.size(); ++n) {
      const double side = random_.Below(2) == 0 ? 1.0 : -1.0;
      term.views.push_back({.i = n,
                            .normal_scan = side * truth_[n].linear().transpose() * direction,
                            .information = 1e5});
    }
    problem_.directions.push_back(term);
  }
  void ExpectTruth(const PoseGraphSolution& solution, double tolerance) const {
    for (std::size_t n = 0; n < truth_.size(); ++n) {
      EXPECT_LT(LargestStep(truth_[n], solution.T_map_scan[n]), tolerance) << "node " << n;
    }
  }

  testing::RandomPoses random_{GetParam()};
  std::vector<Pose> truth_;
  PoseGraphProblem problem_;
};

TEST_P(PoseGraphTest, RelativePosesWithoutNoiseGiveTheTruth) {
  MakePoses(20, 0.2, 1.0);
  for (std::size_t n = 1; n < 20; ++n) AddRelative(n - 1, n);
  for (int k = 0; k < 10; ++k) AddRelative(random_.Below(10), 10 + random_.Below(10));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
  ExpectTruth(solution, 1e-7);
  EXPECT_EQ(solution.summary.termination, PoseGraphTermination::kConverged);
  EXPECT_THAT(solution.summary.held, ElementsAre(0));
  EXPECT_GT(solution.summary.before.relative, 1.0);
  EXPECT_LT(solution.summary.after.total(), 1e-9);
}

TEST_P(PoseGraphTest, ThreePlanesGiveTheTruth) {
  MakePoses(6, 0.05, 0.3);
  AddPlane({Eigen::Vector3d(1, 0.1, 0).normalized(), 4.0});
  AddPlane({Eigen::Vector3d(0, 1, 0.2).normalized(), -3.0});
  AddPlane({Eigen::Vector3d(0.1, 0, 1).normalized(), 1.0});
  for (PlaneTerm& plane : problem_.planes) plane.plane_map.distance += random_.Normal(0.2);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
  ExpectTruth(solution, 1e-4);
  EXPECT_NEAR(solution.planes[1].distance, -3.0, 1e-4);
}

TEST_P(PoseGraphTest, TwoDirectionsTurnScansThatShareNoSurface) {
  MakePoses(6, 0.1, 0.0);
  for (std::size_t n = 1; n < 6; ++n) {
    AddRelative(n - 1, n);
    problem_.relative.back().information.setZero();
    problem_.relative.back().information(5, 5) = 1.0;  // joins them, and says nothing of turns
  }
  AddDirection(Eigen::Vector3d(1, 0.1, 0).normalized());
  AddDirection(Eigen::Vector3d(0, 1, 0.2).normalized());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
  EXPECT_GT(solution.summary.before.directions, 1.0);
  EXPECT_LT(solution.summary.after.directions, 1e-9);
  for (std::size_t n = 0; n < truth_.size(); ++n) {
    EXPECT_LT(RotationAngleRad(truth_[n].inverse() * solution.T_map_scan[n]), 1e-6) << n;
  }
}

TEST_P(PoseGraphTest, WhatPlanesLeaveOpenStays) {
  for (const bool parallel : {false, true}) {
    SCOPED_TRACE(parallel);
    truth_.clear();
    problem_ = {};
    MakePoses(5, 0.03, 0.3);
    AddPlane({Eigen::Vector3d::UnitX(), 4.0});
    AddPlane({parallel ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY(), -3.0});
    STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
    EXPECT_LT(solution.summary.after.planes, 1e-6);
    for (std::size_t n = 0; n < truth_.size(); ++n) {
      // Both leave sliding along z open; turns about points 10 m away move poses a little.
      EXPECT_LT(LargestStep(problem_.T_map_scan[n], solution.T_map_scan[n]), 2.0);
    }
  }
}

TEST_P(PoseGraphTest, APlaneSeenAsOneLineNeitherBreaksNorTurns) {
  MakePoses(6, 0.02, 0.1);
  for (std::size_t n = 1; n < 6; ++n) AddRelative(n - 1, n);
  const Plane roof{Eigen::Vector3d::UnitZ(), 8.0};
  AddPlane(roof, Eigen::Vector3d::UnitX());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
  EXPECT_EQ(solution.summary.termination, PoseGraphTermination::kConverged);
  ExpectTruth(solution, 1e-5);
  // Nothing says how the plane lies about its line.
  EXPECT_LT(std::acos(solution.planes[0].normal.dot(roof.normal)), 0.2);
}

TEST_P(PoseGraphTest, APlaneSeenAsNoisyLinesConverges) {
  MakePoses(6, 0.02, 0.1);
  for (std::size_t n = 1; n < 6; ++n) AddRelative(n - 1, n, 0.05);
  AddPlane({Eigen::Vector3d::UnitZ(), 8.0}, Eigen::Vector3d::UnitX());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
  EXPECT_EQ(solution.summary.termination, PoseGraphTermination::kConverged);
  EXPECT_LT(solution.summary.after.total(), 0.1 * solution.summary.before.total());
}

TEST_P(PoseGraphTest, PositionsPlaceTheMap) {
  MakePoses(10, 0.0, 0.0);
  for (std::size_t n = 1; n < 10; ++n) AddRelative(n - 1, n);
  const Pose moved = Retract(Pose::Identity(), random_.Step(0.3, 2.0));
  for (std::size_t n = 0; n < 10; ++n) {
    problem_.T_map_scan[n] = moved * truth_[n];
    PriorTerm prior{.i = n,
                    .T_map_scan = MakePose(Eigen::Quaterniond::Identity(), truth_[n].translation()),
                    .information = Matrix6d::Zero()};
    prior.information.bottomRightCorner<3, 3>() = 100.0 * Eigen::Matrix3d::Identity();
    problem_.priors.push_back(prior);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
  EXPECT_THAT(solution.summary.held, IsEmpty());
  ExpectTruth(solution, 1e-5);
}

// A chain that drifted away as a whole, with GPS of which walls reflected a part.
TEST_P(PoseGraphTest, PriorsThatAreFalseAreRejectedAndTheOthersPlaceTheMap) {
  MakePoses(30, 0.0, 0.0);
  for (std::size_t n = 1; n < 30; ++n) AddRelative(n - 1, n);
  const Pose moved = Retract(Pose::Identity(), random_.Step(0.2, 5.0));
  for (Pose& T : problem_.T_map_scan) T = moved * T;
  Matrix6d information = Matrix6d::Identity() * 4.0;  // 0.5 m
  information.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() * 100.0;
  std::vector<std::size_t> false_ones;
  for (std::size_t n = 0; n < 30; n += 2) {
    Pose seen = Retract(truth_[n], random_.Step(0.02, 0.1));
    if (n % 10 == 4) {
      false_ones.push_back(problem_.priors.size());
      seen.pretranslate(Eigen::Vector3d(12.0, -9.0, 0.0));
    }
    problem_.priors.push_back(
        {.i = n, .T_map_scan = seen, .information = information, .may_be_false = true});
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
  std::vector<std::size_t> rejected;
  for (const RejectedTerm& term : solution.summary.rejected_priors) rejected.push_back(term.term);
  EXPECT_EQ(rejected, false_ones);
  ExpectTruth(solution, 0.3);
  // Believed, they pull everything with them.
  for (PriorTerm& prior : problem_.priors) prior.may_be_false = false;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto trusting, OptimizePoseGraph(problem_));
  EXPECT_GT((trusting.T_map_scan[0].translation() - truth_[0].translation()).norm(), 1.0);
}

// Each says something else, and nothing that is left places the map.
TEST_P(PoseGraphTest, WhereAllPriorsAreFalseTheFirstPoseStays) {
  MakePoses(30, 0.3, 2.0);
  for (std::size_t n = 1; n < 30; ++n) AddRelative(n - 1, n, 0.01);
  for (std::size_t n = 0; n < 30; n += 5) {
    Pose seen = truth_[n];
    seen.pretranslate(Eigen::Vector3d(0.0, 0.0, n % 2 == 0 ? 1000.0 : -1000.0));
    seen.pretranslate(Eigen::Vector3d(50.0 * static_cast<double>(n), 0.0, 0.0));
    problem_.priors.push_back({.i = n,
                               .T_map_scan = seen,
                               .information = Matrix6d::Identity() * 100.0,
                               .may_be_false = true});
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
  EXPECT_EQ(solution.summary.rejected_priors.size(), problem_.priors.size());
  EXPECT_THAT(solution.summary.held, ElementsAre(0));
  EXPECT_LT((solution.T_map_scan[0].translation() - problem_.T_map_scan[0].translation()).norm(),
            0.05);
}

// Two chains, and closures between them of which each says something else.
TEST_P(PoseGraphTest, WhatFalseClosuresJoinedStaysWhereItBegan) {
  MakePoses(30, 0.05, 0.3);
  for (std::size_t n = 1; n < 30; ++n) {
    if (n != 15) AddRelative(n - 1, n, 0.01);
  }
  for (std::size_t n = 0; n < 15; n += 3) {
    Pose seen = truth_[n].inverse() * truth_[n + 15];
    seen.pretranslate(Eigen::Vector3d(50.0 * static_cast<double>(n), 0.0, n % 2 == 0 ? 1e3 : -1e3));
    problem_.relative.push_back({.i = n,
                                 .j = n + 15,
                                 .T_i_j = seen,
                                 .information = Matrix6d::Identity() * 100.0,
                                 .may_be_false = true});
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
  EXPECT_EQ(solution.summary.rejected_relative.size(), 5U);
  EXPECT_THAT(solution.summary.held, ElementsAre(0, 15));
  for (const std::size_t n : {0, 15}) {
    EXPECT_LT(LargestStep(problem_.T_map_scan[n], solution.T_map_scan[n]), 1e-9);
  }
}

TEST_P(PoseGraphTest, EveryComponentIsHeldOnceAndFixedPosesStay) {
  MakePoses(9, 0.1, 0.5);
  AddRelative(0, 1);
  AddRelative(2, 3);
  AddRelative(3, 4);
  AddRelative(5, 6);
  AddPlane({Eigen::Vector3d::UnitZ(), 0.0});
  problem_.planes[0].views.erase(problem_.planes[0].views.begin(),
                                 problem_.planes[0].views.begin() + 7);  // 7 and 8 see it
  problem_.fixed.assign(9, false);
  problem_.fixed[3] = true;
  problem_.priors.push_back({.i = 6, .T_map_scan = truth_[6], .information = Matrix6d::Identity()});
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
  EXPECT_THAT(solution.summary.held, ElementsAre(0, 7));
  for (const std::size_t n : {0, 3, 7}) {
    EXPECT_EQ(problem_.T_map_scan[n].matrix(), solution.T_map_scan[n].matrix());
  }
  EXPECT_LT(LargestStep(truth_[5], solution.T_map_scan[5]), 1e-6);
}

// All kinds of terms, none without noise.
class MixedGraphTest : public PoseGraphTest {
 protected:
  void SetUp() override {
    MakePoses(12, 0.1, 0.5);
    for (std::size_t n = 1; n < 12; ++n) AddRelative(n - 1, n, 0.1);
    for (int k = 0; k < 6; ++k) AddRelative(random_.Below(6), 6 + random_.Below(6), 0.1);
    AddPlane({Eigen::Vector3d(1, 0.1, 0).normalized(), 4.0});
    AddPlane({Eigen::Vector3d(0, 0.1, 1).normalized(), 1.0});
    AddDirection(Retract(Pose::Identity(), random_.Step(0.01, 0.0)).linear().col(0));
    problem_.directions[0].direction_map = Eigen::Vector3d::UnitX();
    for (DirectionTerm::View& view : problem_.directions[0].views) view.information = 1e3;
    problem_.priors.push_back({.i = 4,
                               .T_map_scan = Retract(truth_[4], random_.Step(0.1, 0.1)),
                               .information = random_.Information()});
  }
};

TEST_P(MixedGraphTest, NoNeighbourIsBetter) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
  EXPECT_EQ(solution.summary.termination, PoseGraphTermination::kConverged);
  // Costs without moving, from one iteration that is not allowed to lead anywhere: the summary's
  // `before` of a problem that starts at the neighbour.
  PoseGraphProblem neighbour = problem_;
  for (std::size_t p = 0; p < 2; ++p) neighbour.planes[p].plane_map = solution.planes[p];
  PoseGraphOptions once;
  once.convergence.max_iterations = 1;
  const double best = solution.summary.after.total();
  for (int k = 0; k < 200; ++k) {
    const double size = std::pow(10.0, -0.02 * k);
    neighbour.T_map_scan = solution.T_map_scan;
    for (Pose& T : neighbour.T_map_scan) T = Retract(T, random_.Step(size, size));
    STRATA_ASSERT_OK_AND_ASSIGN(const auto other, OptimizePoseGraph(neighbour, once));
    EXPECT_GE(other.summary.before.total(), best * (1.0 - 1e-6));
  }
}

TEST_P(MixedGraphTest, EqualWeightsAreCovarianceAndOthersTrade) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto by_covariance, OptimizePoseGraph(problem_));
  PoseGraphOptions options;
  options.weighting = Weighting::kLocalGlobal;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto equal, OptimizePoseGraph(problem_, options));
  for (std::size_t n = 0; n < truth_.size(); ++n) {
    EXPECT_EQ(by_covariance.T_map_scan[n].matrix(), equal.T_map_scan[n].matrix());
  }
  options.local_weight = 0.95;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto trusting, OptimizePoseGraph(problem_, options));
  EXPECT_LT(trusting.summary.after.relative, equal.summary.after.relative);
  EXPECT_GT(trusting.summary.after.planes + trusting.summary.after.priors,
            equal.summary.after.planes + equal.summary.after.priors);
}

TEST_P(MixedGraphTest, TheSameInputGivesTheSameBytes) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto a, OptimizePoseGraph(problem_));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto b, OptimizePoseGraph(problem_));
  for (std::size_t n = 0; n < truth_.size(); ++n) {
    EXPECT_EQ(a.T_map_scan[n].matrix(), b.T_map_scan[n].matrix());
  }
}

TEST_P(MixedGraphTest, WorstNodesAddUpAndComeFirst) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_));
  const auto& worst = solution.summary.worst_nodes;
  ASSERT_EQ(worst.size(), 10U);
  double sum = 0.0;
  for (std::size_t k = 0; k < worst.size(); ++k) {
    sum += worst[k].chi2;
    EXPECT_LE(worst[k].chi2, worst[k == 0 ? 0 : k - 1].chi2);
  }
  EXPECT_LE(sum, solution.summary.after.total() * (1.0 + 1e-9));
  EXPECT_GE(sum, solution.summary.after.total() * 10.0 / 12.0 * (1.0 - 1e-9));
}

TEST_P(MixedGraphTest, StopsWhenAsked) {
  Stop stop;
  stop.Request();
  EXPECT_THAT(OptimizePoseGraph(problem_, {}, stop),
              StatusIs(absl::StatusCode::kCancelled, ::testing::_));
  PoseGraphOptions options;
  options.convergence.max_iterations = 2;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(problem_, options));
  EXPECT_EQ(solution.summary.iterations, 2);
  EXPECT_EQ(solution.summary.termination, PoseGraphTermination::kMaxIterations);
}

INSTANTIATE_TEST_SUITE_P(Seeds, PoseGraphTest, ::testing::Values(1, 2, 3));
INSTANTIATE_TEST_SUITE_P(Seeds, MixedGraphTest, ::testing::Values(1, 2, 3));

TEST(PoseGraphErrorsTest, NameTheTermTheFieldAndTheBound) {
  PoseGraphProblem good;
  good.T_map_scan.assign(2, Pose::Identity());
  good.relative.push_back({.i = 0, .j = 1});
  good.planes.push_back({.plane_map = {}, .views = {{.i = 1}}});
  good.directions.push_back({.views = {{.i = 1}}});
  good.priors.push_back({.i = 1});
  STRATA_EXPECT_OK(OptimizePoseGraph(good));

  const auto expect = [&good](auto spoil, const std::string& message) {
    PoseGraphProblem bad = good;
    PoseGraphOptions options;
    spoil(bad, options);
    EXPECT_THAT(OptimizePoseGraph(bad, options),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  expect([](auto& p, auto&) { p.fixed.resize(3); }, "fixed has 3 entries");
  expect([](auto& p, auto&) { p.T_map_scan[1](0, 3) = kNan; }, "T_map_scan 1: pose: not finite");
  expect([](auto& p, auto&) { p.relative[0].j = 2; }, "relative pose 0: j is 2, but there are 2");
  expect([](auto& p, auto&) { p.relative[0].j = 0; }, "i and j are both 0");
  expect([](auto& p, auto&) { p.relative[0].T_i_j.linear() *= 2.0; }, "T_i_j: pose: linear part");
  expect([](auto& p, auto&) { p.relative[0].information(0, 1) = 1.0; }, "not symmetric");
  expect([](auto& p, auto&) { p.relative[0].information(2, 2) = -1.0; }, "negative eigenvalue");
  expect([](auto& p, auto&) { p.planes[0].views[0].moments(0, 0) = kNan; }, "not fin");
  expect([](auto& p, auto&) { p.planes[0].plane_map.normal *= 2.0; }, "unit normal");
  expect([](auto& p, auto&) { p.planes[0].views[0].i = 9; }, "a view's i is 9");
  expect([](auto& p, auto&) { p.directions[0].direction_map *= 2.0; }, "direction_map: has the le");
  expect([](auto& p, auto&) { p.directions[0].views[0].normal_scan(1) = kNan; }, "length nan");
  expect([](auto& p, auto&) { p.directions[0].views[0].information = -1.0; }, "not negative");
  expect([](auto& p, auto&) { p.directions[0].views[0].i = 3; }, "direction 0: a view's i is 3");
  expect([](auto& p, auto&) { p.priors[0].i = 2; }, "prior 0: i is 2");
  expect([](auto&, auto& o) { o.local_weight = 1.5; }, "local_weight is 1.5");
  expect([](auto&, auto& o) { o.max_closure_chi2 = 0.0; }, "max_closure_chi2 is 0");
  expect([](auto&, auto& o) { o.convergence.max_iterations = 0; }, "max_iterations is 0");
}

TEST(PoseGraphErrorsTest, NothingToDoIsNoError) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto empty, OptimizePoseGraph({}));
  EXPECT_EQ(empty.summary.termination, PoseGraphTermination::kNothingToDo);
  PoseGraphProblem alone;
  alone.T_map_scan.assign(3, Pose::Identity());
  STRATA_ASSERT_OK_AND_ASSIGN(const auto solution, OptimizePoseGraph(alone));
  EXPECT_EQ(solution.summary.termination, PoseGraphTermination::kNothingToDo);
  EXPECT_THAT(solution.summary.held, ElementsAre(0, 1, 2));
}

}  // namespace
}  // namespace strata
