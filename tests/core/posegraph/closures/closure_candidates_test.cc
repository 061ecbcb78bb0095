#include "core/posegraph/closures/closure_candidates.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::Each;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::StatusIs;

Matrix6d Information() {
  Vector6d diagonal;
  diagonal << 1e6, 1e6, 1e6, 1e4, 1e4, 1e4;
  return diagonal.asDiagonal();
}

struct Graph {
  std::vector<ClosureNode> nodes;
  std::vector<GraphEdge> edges;

  void Drive(std::uint32_t trajectory, const std::vector<Pose>& poses) {
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (i > 0) edges.push_back({nodes.size() - 1, nodes.size(), Information()});
      nodes.push_back({poses[i], trajectory});
    }
  }
};

// Round a circle of 200 m, a little more than `rounds` times, a pose every 2 m.
std::vector<Pose> Circle(double rounds, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  std::vector<Pose> poses;
  const double radius = 100.0 / std::numbers::pi;
  for (double way = 0.0; way < 200.0 * rounds + 3.0; way += 2.0) {
    const double angle = way / radius;
    Pose T = Pose::Identity();
    T.linear() = Eigen::AngleAxisd(angle + std::numbers::pi / 2, Eigen::Vector3d::UnitZ())
                     .toRotationMatrix();
    T.translation() = centre + radius * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
    poses.push_back(T);
  }
  return poses;
}

double Apart(const Graph& graph, const ClosureCandidate& c) {
  return (graph.nodes[c.i].T_map_scan.translation() - graph.nodes[c.j].T_map_scan.translation())
      .norm();
}

TEST(ClosureCandidatesTest, ALoopsEndIsTriedAgainstItsStart) {
  Graph graph;
  graph.Drive(7, Circle(1.0));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto candidates,
                              FindClosureCandidates(graph.nodes, graph.edges, {}));
  ASSERT_FALSE(candidates.empty());
  for (const ClosureCandidate& c : candidates) {
    EXPECT_LT(c.i, c.j);
    EXPECT_EQ(c.reason, ClosureReason::kNear);
    EXPECT_GT(c.j - c.i, 80U);
    EXPECT_LE(Apart(graph, c), 12.0 + 2.0 * c.sigma_m);
    ASSERT_EQ(c.hypotheses.size(), 1U);
    EXPECT_TRUE(c.hypotheses[0].T_target_source.isApprox(c.T_i_j));
    EXPECT_GE(c.hypotheses[0].radius_m, std::min(2.0 * c.sigma_m, 25.0));
  }
  EXPECT_LT(Apart(graph, candidates[0]), 6.0);
  EXPECT_TRUE(std::is_sorted(
      candidates.begin(), candidates.end(), [](auto& a, auto& b) { return a.score > b.score; }));
}

TEST(ClosureCandidatesTest, ASecondRoundIsTriedAllAroundAndEvenly) {
  Graph graph;
  graph.Drive(1, Circle(2.0));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto candidates,
                              FindClosureCandidates(graph.nodes, graph.edges, {}));
  const double step =
      (graph.nodes[1].T_map_scan.translation() - graph.nodes[0].T_map_scan.translation()).norm();
  const auto segment_of = [&](std::size_t node) {
    return static_cast<std::size_t>(static_cast<double>(node) * step / 10.0);
  };
  std::vector<int> by_quarter(4, 0);
  std::map<std::pair<std::size_t, std::size_t>, int> by_segments;
  for (const ClosureCandidate& c : candidates) {
    ++by_quarter[std::min<std::size_t>(3, c.j % 100 / 25)];
    ++by_segments[{segment_of(c.i), segment_of(c.j)}];
  }
  EXPECT_THAT(by_quarter, Each(::testing::Gt(5)));
  for (const auto& [segments, count] : by_segments) EXPECT_LE(count, 2);
}

TEST(ClosureCandidatesTest, WhatIsClosedIsNotTriedAgain) {
  Graph graph;
  graph.Drive(1, Circle(1.0));
  graph.edges.push_back({0, graph.nodes.size() - 1, Information()});
  STRATA_ASSERT_OK_AND_ASSIGN(const auto candidates,
                              FindClosureCandidates(graph.nodes, graph.edges, {}));
  EXPECT_THAT(candidates, IsEmpty());
}

TEST(ClosureCandidatesTest, StraightOnNothingIsNear) {
  Graph graph;
  std::vector<Pose> poses(200, Pose::Identity());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    poses[i].translation().x() = 2.0 * static_cast<double>(i);
  }
  graph.Drive(1, poses);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto candidates,
                              FindClosureCandidates(graph.nodes, graph.edges, {}));
  EXPECT_THAT(candidates, IsEmpty());
}

TEST(ClosureCandidatesTest, RobotsThatNothingConnectsAreTriedWhereTheyLookAlike) {
  Graph graph;
  graph.Drive(1, Circle(0.5));
  const std::size_t other = graph.nodes.size();
  graph.Drive(2, Circle(0.5, {1000.0, 0.0, 0.0}));
  const AlikePair alike[] = {{other + 10, 10, {0.3, 1.0}}, {12, other + 12, {0.9, 1.0}}};
  STRATA_ASSERT_OK_AND_ASSIGN(const auto candidates,
                              FindClosureCandidates(graph.nodes, graph.edges, alike));
  ASSERT_EQ(candidates.size(), 1U) << "the second pair does not look alike enough";
  EXPECT_EQ(candidates[0].i, 10U);
  EXPECT_EQ(candidates[0].j, other + 10);
  EXPECT_EQ(candidates[0].reason, ClosureReason::kAlike);
  EXPECT_TRUE(std::isinf(candidates[0].sigma_m));
  ASSERT_EQ(candidates[0].hypotheses.size(), 3U);
  EXPECT_TRUE(candidates[0].hypotheses[2].T_target_source.isApprox(candidates[0].T_i_j))
      << "what looks alike has to fit better than what the frames say";
  // The index compared j with i, so the heading is the other way round.
  const Eigen::Matrix3d& R = candidates[0].hypotheses[0].T_target_source.linear();
  EXPECT_NEAR(std::remainder(std::atan2(R(1, 0), R(0, 0)) + 1.0, std::numbers::pi), 0.0, 1e-9);
}

TEST(ClosureCandidatesTest, RobotsWhoseFramesSayThatTheyAreNearAreTriedThere) {
  Graph graph;
  graph.Drive(1, Circle(0.2));
  const std::size_t other = graph.nodes.size();
  graph.Drive(2, Circle(0.2, {8.0, 0.0, 0.0}));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto candidates,
                              FindClosureCandidates(graph.nodes, graph.edges, {}));
  EXPECT_GT(candidates.size(), 5U);
  for (const ClosureCandidate& c : candidates) {
    EXPECT_LT(c.i, other);
    EXPECT_GE(c.j, other);
    EXPECT_LE(Apart(graph, c), 12.0);
    EXPECT_EQ(c.reason, ClosureReason::kNear);
    ASSERT_EQ(c.hypotheses.size(), 1U);
    EXPECT_EQ(c.hypotheses[0].radius_m, SaidHypothesis(c.T_i_j).radius_m);
  }
}

TEST(ClosureCandidatesTest, LooksThatThePosesRuleOutAreNotTried) {
  Graph graph;
  graph.Drive(1, Circle(0.8));
  const AlikePair alike[] = {{0, 50, {0.2, 0.0}}};  // opposite sides of the circle
  STRATA_ASSERT_OK_AND_ASSIGN(const auto candidates,
                              FindClosureCandidates(graph.nodes, graph.edges, alike));
  EXPECT_THAT(candidates, Each(Field(&ClosureCandidate::reason, ClosureReason::kNear)));
  // With odometry worth nothing they are.
  ClosureCandidateOptions options;
  options.drift = {1.0, 0.1};
  STRATA_ASSERT_OK_AND_ASSIGN(const auto unsure,
                              FindClosureCandidates(graph.nodes, graph.edges, alike, options));
  EXPECT_TRUE(std::any_of(unsure.begin(), unsure.end(), [](const ClosureCandidate& c) {
    return c.i == 0 && c.j == 50 && c.reason == ClosureReason::kAlike;
  }));
}

TEST(ClosureCandidatesTest, RefusesNonsense) {
  Graph graph;
  graph.Drive(1, Circle(0.1));
  const AlikePair nowhere[] = {{0, 1000, {0.1, 0.0}}};
  EXPECT_THAT(
      FindClosureCandidates(graph.nodes, graph.edges, nowhere),
      StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("alike pair 0 joins 0 and 1000")));
  graph.edges.push_back({2, 2, Information()});
  EXPECT_THAT(FindClosureCandidates(graph.nodes, graph.edges, {}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("joins 2 and 2")));
  graph.edges.pop_back();
  graph.nodes[3].T_map_scan.translation().x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(FindClosureCandidates(graph.nodes, graph.edges, {}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("closure node 3")));
  ClosureCandidateOptions options;
  options.per_segment = 0;
  EXPECT_THAT(FindClosureCandidates({}, {}, {}, options),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("per_segment is 0")));
}

}  // namespace
}  // namespace strata
