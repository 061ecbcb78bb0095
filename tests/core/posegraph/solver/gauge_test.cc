#include "core/posegraph/solver/gauge.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/disjoint_sets.h"
#include "core/posegraph/pose_graph.h"

namespace strata {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(GaugeTest, EachSetHasItsFirstNode) {
  DisjointSets sets;
  sets.Join(6, 4);
  sets.Join(1, 3);
  sets.Join(3, 6);
  sets.Join(5, 2);
  EXPECT_THAT(FirstUnheld(sets, std::vector<bool>(7, false)), ElementsAre(0, 1, 2));
}

TEST(GaugeTest, OneHeldNodeHoldsASet) {
  DisjointSets sets;
  sets.Join(0, 1);
  sets.Join(2, 3);
  EXPECT_THAT(FirstUnheld(sets, {false, true, false, false}), ElementsAre(2));
  EXPECT_THAT(FirstUnheld(sets, {false, true, true, true}), IsEmpty());
}

// 0-1 are joined for sure and 2-3 are, and 4 is alone; a plane and a closure are between them.
PoseGraphProblem ThreeParts() {
  PoseGraphProblem problem;
  problem.T_map_scan.assign(5, Pose::Identity());
  problem.relative = {{.i = 0, .j = 1}, {.i = 2, .j = 3}, {.i = 1, .j = 3}};
  problem.relative[2].may_be_false = true;
  problem.planes.push_back({.plane_map = {}, .views = {{.i = 0}, {.i = 4}}});
  return problem;
}

TEST(GaugeTest, WhatMayCountNothingHoldsNothing) {
  const PoseGraphProblem problem = ThreeParts();
  EXPECT_THAT(NodesToHold(problem, TermWeights::OfAll(problem)), ElementsAre(0));
  EXPECT_THAT(NodesToHold(problem, {{1.0, 1.0, 0.0}, {}}), ElementsAre(0, 2));
  EXPECT_THAT(NodesInDoubt(problem), ElementsAre(2, 4));
}

TEST(GaugeTest, APriorEndsTheDoubtUnlessItMayBeFalse) {
  PoseGraphProblem problem = ThreeParts();
  problem.priors.push_back({.i = 3});
  EXPECT_THAT(NodesInDoubt(problem), ElementsAre(0, 4));
  problem.priors[0].may_be_false = true;
  EXPECT_THAT(NodesInDoubt(problem), ElementsAre(0, 2, 4));
  problem.fixed = {false, true, false, false, true};
  EXPECT_THAT(NodesInDoubt(problem), ElementsAre(2));
}

}  // namespace
}  // namespace strata
