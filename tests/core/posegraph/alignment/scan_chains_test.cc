#include "core/posegraph/alignment/scan_chains.h"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Nodes = std::vector<std::size_t>;

Pose At(double x, double y) { return MakePose(Eigen::Quaterniond::Identity(), {x, y, 0.0}); }

// Three robots on one road along x, a scan every metre: the first goes there and, 60 m on, comes
// back on the other side; the second goes with it; the third is far away.
class ScanChainsTest : public ::testing::Test {
 protected:
  static constexpr std::size_t kLength = 60;
  static constexpr std::size_t kBack = kLength;       // first node on the way back
  static constexpr std::size_t kOther = 2 * kLength;  // first of the second robot
  static constexpr std::size_t kAway = 3 * kLength;   // first of the third
  static constexpr std::size_t kNodes = 3 * kLength + 5;

  ScanChainsTest() {
    Nodes there_and_back, other, away;
    for (std::size_t k = 0; k < kNodes; ++k) {
      const auto x = static_cast<double>(k % kLength);
      if (k < kBack) {
        problem_.T_map_scan.push_back(At(x, 0.0));
      } else if (k < kOther) {
        problem_.T_map_scan.push_back(At(kLength - 1.0 - x, 2.0));
      } else if (k < kAway) {
        problem_.T_map_scan.push_back(At(x, -1.0));
      } else {
        problem_.T_map_scan.push_back(At(x, 1000.0));
      }
      (k < kOther ? there_and_back : k < kAway ? other : away).push_back(k);
    }
    problem_.trajectories = {there_and_back, other, away};
    problem_.relative = {{.i = 0, .j = kOther}, {.i = 0, .j = kAway}};
    policy_.radius_m = 3.5;
    policy_.max_scans = 100;
  }

  std::vector<ScanChain> Around(std::size_t node, const std::vector<bool>& loose = {}) const {
    return ScanChains(problem_, policy_).Around(node, problem_.T_map_scan, loose);
  }
  // Where the way back passes x.
  static std::size_t BackAt(std::size_t x) { return kBack + kLength - 1 - x; }

  AlignmentProblem problem_;
  NeighbourPolicy policy_;
};

TEST_F(ScanChainsTest, WhatNothingJoinsIsNotNear) {
  problem_.relative.clear();
  EXPECT_THAT(Around(10), SizeIs(2));
  EXPECT_THAT(Around(kOther + 10), SizeIs(1));
  problem_.priors = {{.i = kBack}, {.i = kOther}};  // GPS says how they lie
  EXPECT_THAT(Around(10), SizeIs(3));
  problem_.priors.clear();
  problem_.pairs = {{10, kOther + 10}};
  EXPECT_THAT(Around(30), SizeIs(3));
}

TEST_F(ScanChainsTest, AChainEndsBeforeALooseStep) {
  std::vector<bool> loose(kNodes, false);
  loose[9] = true;
  loose[BackAt(10)] = true;
  const std::vector<ScanChain> chains = Around(10, loose);
  ASSERT_THAT(chains, SizeIs(5));
  EXPECT_THAT(chains[0].nodes, ElementsAre(7, 8));
  EXPECT_FALSE(chains[0].own);
  EXPECT_TRUE(chains[0].may_be_false);
  EXPECT_THAT(chains[1].nodes, ElementsAre(9));
  EXPECT_TRUE(chains[1].own);
  EXPECT_THAT(chains[2].nodes, ElementsAre(BackAt(12), BackAt(11)));
  EXPECT_THAT(chains[3].nodes, ElementsAre(BackAt(10), BackAt(9), BackAt(8)));
  // The step to a scan itself: what is behind it is what it has to be matched to.
  ASSERT_THAT(Around(9, loose), SizeIs(4));
  EXPECT_THAT(Around(9, loose)[0].nodes, ElementsAre(6, 7, 8));
  EXPECT_TRUE(Around(9, loose)[0].own);
}

TEST_F(ScanChainsTest, OfItsOwnPassOnlyWhatIsBehindOfOthersAll) {
  const std::vector<ScanChain> chains = Around(10);
  ASSERT_THAT(chains, SizeIs(3));
  EXPECT_THAT(chains[0].nodes, ElementsAre(7, 8, 9));
  EXPECT_TRUE(chains[0].own);
  EXPECT_FALSE(chains[0].may_be_false);
  // √(3.5² − 2²) = 2.9 m to both sides.
  EXPECT_THAT(chains[1].nodes,
              ElementsAre(BackAt(12), BackAt(11), BackAt(10), BackAt(9), BackAt(8)));
  EXPECT_FALSE(chains[1].own);
  EXPECT_TRUE(chains[1].may_be_false);
  EXPECT_THAT(
      chains[2].nodes,
      ElementsAre(
          kOther + 7, kOther + 8, kOther + 9, kOther + 10, kOther + 11, kOther + 12, kOther + 13));
  EXPECT_FALSE(chains[2].own);
  EXPECT_TRUE(chains[2].may_be_false);
}

TEST_F(ScanChainsTest, ThePassBeforeSeesTheOneAfterAsAnother) {
  const std::vector<ScanChain> chains = Around(BackAt(10));
  ASSERT_THAT(chains, SizeIs(3));
  EXPECT_THAT(chains[0].nodes, ElementsAre(8, 9, 10, 11, 12));
  EXPECT_TRUE(chains[0].may_be_false);
  EXPECT_THAT(chains[1].nodes, ElementsAre(BackAt(13), BackAt(12), BackAt(11)));
  EXPECT_TRUE(chains[1].own);
}

TEST_F(ScanChainsTest, AfterATurnTheWayBackIsStillTheSamePass) {
  const std::vector<ScanChain> chains = Around(BackAt(57));
  // The way there begins five scans before: one chain, and nothing ahead.
  ASSERT_THAT(chains, SizeIs(2));
  EXPECT_TRUE(chains[0].own);
  EXPECT_THAT(chains[0].nodes, ElementsAre(55, 56, 57, 58, 59, BackAt(59), BackAt(58)));
  EXPECT_FALSE(chains[1].own);
}

TEST_F(ScanChainsTest, AScanWithNothingAroundHasNoChain) {
  problem_.T_map_scan[kAway] = At(0.0, -1000.0);
  EXPECT_THAT(Around(kAway), IsEmpty());
}

TEST_F(ScanChainsTest, AtMostSoManyOfTheNearest) {
  policy_.max_scans = 1;  // beside the scan itself
  const std::vector<ScanChain> chains = Around(10);
  // Four are one metre away; of those the last.
  ASSERT_THAT(chains, SizeIs(1));
  EXPECT_THAT(chains[0].nodes, ElementsAre(kOther + 10));
}

TEST_F(ScanChainsTest, PairsCountHoweverFarTheyAre) {
  problem_.pairs.push_back({.i = 3, .j = kAway + 2});
  problem_.pairs.push_back({.i = 40, .j = 10, .may_be_false = true});
  const std::vector<ScanChain> far = Around(kAway + 2);
  ASSERT_THAT(far, SizeIs(2));
  EXPECT_THAT(far[0].nodes, ElementsAre(3));
  EXPECT_FALSE(far[0].may_be_false);  // known, not near
  EXPECT_TRUE(far[1].own);
  // From both ends.
  const std::vector<ScanChain> other_end = Around(3);
  ASSERT_THAT(other_end, SizeIs(4));
  EXPECT_THAT(other_end[3].nodes, ElementsAre(kAway + 2));
  EXPECT_FALSE(other_end[3].may_be_false);
  // 40 is ahead of 10 by exactly as much as is still the same pass.
  EXPECT_THAT(Around(10), SizeIs(3));
  const std::vector<ScanChain> back = Around(40);
  ASSERT_THAT(back, SizeIs(4));
  EXPECT_THAT(back[0].nodes, ElementsAre(10));
  EXPECT_TRUE(back[0].own);
}

TEST_F(ScanChainsTest, AClosureMayBeFalseButAKnownPairSpeaksForItsChain) {
  problem_.pairs.push_back({.i = kOther + 11, .j = 10, .may_be_false = true});
  EXPECT_TRUE(Around(10)[2].may_be_false);
  problem_.pairs.push_back({.i = kOther + 12, .j = 10});
  EXPECT_FALSE(Around(10)[2].may_be_false);
  EXPECT_THAT(Around(10)[2].nodes, SizeIs(7));  // each once, though named twice
}

TEST_F(ScanChainsTest, ExcludedPairsAreNeverHeldAgainstEachOther) {
  problem_.pairs.push_back({.i = kOther + 9, .j = 10});
  problem_.excluded_pairs = {{kOther + 9, 10}, {10, kOther + 8}, {9, 10}};
  const std::vector<ScanChain> chains = Around(10);
  ASSERT_THAT(chains, SizeIs(3));
  EXPECT_THAT(chains[0].nodes, ElementsAre(7, 8));
  EXPECT_THAT(chains[2].nodes,
              ElementsAre(kOther + 7, kOther + 10, kOther + 11, kOther + 12, kOther + 13));
  EXPECT_TRUE(chains[2].may_be_false);
  // The others still are.
  EXPECT_THAT(Around(11)[0].nodes, ElementsAre(8, 9, 10));
}

TEST_F(ScanChainsTest, TheyFollowThePoses) {
  std::vector<Pose> moved = problem_.T_map_scan;
  for (std::size_t k = kOther; k < kAway; ++k) moved[k].translation().y() = 500.0;
  const ScanChains chains(problem_, policy_);
  EXPECT_THAT(chains.Around(10, problem_.T_map_scan), SizeIs(3));
  EXPECT_THAT(chains.Around(10, moved), SizeIs(2));
}

}  // namespace
}  // namespace strata
