#include "core/posegraph/closures/closure_consistency.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::StatusIs;

Pose Step(double yaw, double x, double y, double z) {
  Vector6d step;
  step << 0.0, 0.0, yaw, x, y, z;
  return Retract(Pose::Identity(), step);
}

// Two robots drive the same winding street; each knows only its own odometry, which drifts, and has
// its own origin.
class TwoRobots {
 public:
  static constexpr std::size_t kScans = 60;

  explicit TwoRobots(std::uint64_t seed) : random_(seed) {
    Pose T = Pose::Identity();
    for (std::size_t i = 0; i < kScans; ++i) {
      truth_.push_back(T);
      T = T * Step(0.08 * std::sin(0.2 * static_cast<double>(i)), 2.0, 0.0, 0.0);
    }
    for (std::size_t i = 0; i < kScans; ++i) truth_.push_back(truth_[i] * Step(0.3, 0.5, 1.0, 0.0));
    const Matrix6d information = Sigmas(0.003, 0.03).cwiseAbs2().cwiseInverse().asDiagonal();
    for (const std::size_t first : {std::size_t{0}, kScans}) {
      poses.push_back(first == 0 ? Pose::Identity() : Step(2.0, 300.0, -50.0, 7.0));
      for (std::size_t i = first + 1; i < first + kScans; ++i) {
        poses.push_back(poses.back() *
                        Noisy(truth_[i - 1].inverse() * truth_[i], Sigmas(0.003, 0.03)));
        edges.push_back({i - 1, i, information});
      }
    }
  }

  Closure True(std::size_t i, std::size_t j) {
    return {i, j, Noisy(truth_[i].inverse() * truth_[j], Sigmas(0.003, 0.02)), 0.1, 0.01};
  }
  Closure False(std::size_t i, std::size_t j) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    return {i,
            j,
            Step(3.0 * uniform(random_), 8 * uniform(random_), 8 * uniform(random_), 0.0),
            0.1,
            0.01};
  }

  std::vector<Pose> poses;
  std::vector<GraphEdge> edges;

 private:
  static Vector6d Sigmas(double rad, double m) {
    Vector6d sigmas;
    sigmas << rad, rad, rad, m, m, m;
    return sigmas;
  }
  Pose Noisy(const Pose& T, const Vector6d& sigmas) {
    std::normal_distribution<double> normal;
    Vector6d step;
    for (int k = 0; k < 6; ++k) step[k] = sigmas[k] * normal(random_);
    return Retract(T, step);
  }

  std::mt19937_64 random_;
  std::vector<Pose> truth_;
};

TEST(ClosureConsistencyTest, TheTrueOnesAgreeAndTheFalseOnesDoNot) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    TwoRobots robots(seed);
    std::vector<Closure> closures;
    for (std::size_t k = 0; k < 8; ++k) {
      closures.push_back(robots.True(7 * k, TwoRobots::kScans + 7 * k + 2));
      closures.push_back(robots.False(6 * k + 3, TwoRobots::kScans + 50 - 5 * k));
    }
    closures.push_back({TwoRobots::kScans + 30,
                        29,  // the other way round
                        robots.True(TwoRobots::kScans + 30, 29).T_i_j,
                        0.1,
                        0.01});
    STRATA_ASSERT_OK_AND_ASSIGN(const ConsistentClosureSet set,
                                ConsistentClosures(robots.poses, robots.edges, closures));
    EXPECT_THAT(set.kept, ElementsAre(0, 2, 4, 6, 8, 10, 12, 14, 16)) << "seed " << seed;
    EXPECT_GE(set.support[0], 7);
    EXPECT_LE(set.support[1], 3);
  }
}

TEST(ClosureConsistencyTest, OneAloneBetweenTwoRobotsIsNotBelieved) {
  TwoRobots robots(1);
  const std::vector<Closure> one = {robots.True(5, TwoRobots::kScans + 5)};
  STRATA_ASSERT_OK_AND_ASSIGN(ConsistentClosureSet set,
                              ConsistentClosures(robots.poses, robots.edges, one));
  EXPECT_THAT(set.kept, IsEmpty());
  ClosureConsistencyOptions trusting;
  trusting.min_between_parts = 1;
  trusting.min_spread_m = 0.0;
  STRATA_ASSERT_OK_AND_ASSIGN(set, ConsistentClosures(robots.poses, robots.edges, one, trusting));
  EXPECT_THAT(set.kept, ElementsAre(0));
}

TEST(ClosureConsistencyTest, ClosuresOfOneScanBetweenTwoRobotsAreNotBelieved) {
  TwoRobots robots(1);
  std::vector<Closure> closures;
  for (const std::size_t i : {4, 5, 6}) closures.push_back(robots.True(i, TwoRobots::kScans + 5));
  STRATA_ASSERT_OK_AND_ASSIGN(ConsistentClosureSet set,
                              ConsistentClosures(robots.poses, robots.edges, closures));
  EXPECT_THAT(set.kept, IsEmpty());
  closures.push_back(robots.True(7, TwoRobots::kScans + 8));
  STRATA_ASSERT_OK_AND_ASSIGN(set, ConsistentClosures(robots.poses, robots.edges, closures));
  EXPECT_THAT(set.kept, ElementsAre(0, 1, 2, 3));
}

TEST(ClosureConsistencyTest, ClosuresOfScansOfOneSpotBetweenTwoRobotsAreNotBelieved) {
  TwoRobots robots(2);
  const std::size_t other = TwoRobots::kScans;
  std::vector<Closure> closures;
  for (const std::size_t i : {4, 5, 6}) closures.push_back(robots.True(i, other + i));  // 4 m
  STRATA_ASSERT_OK_AND_ASSIGN(ConsistentClosureSet set,
                              ConsistentClosures(robots.poses, robots.edges, closures));
  EXPECT_THAT(set.kept, IsEmpty());
  closures.push_back(robots.True(7, other + 4));  // 6 m on one side alone
  STRATA_ASSERT_OK_AND_ASSIGN(set, ConsistentClosures(robots.poses, robots.edges, closures));
  EXPECT_THAT(set.kept, IsEmpty());
  closures.push_back(robots.True(4, other + 7));
  STRATA_ASSERT_OK_AND_ASSIGN(set, ConsistentClosures(robots.poses, robots.edges, closures));
  EXPECT_THAT(set.kept, ElementsAre(0, 1, 2, 3, 4));
}

TEST(ClosureConsistencyTest, OneThatAgreesWithWhatTheFramesSayOutweighsManyThatDoNot) {
  TwoRobots robots(3);
  const std::size_t other = TwoRobots::kScans;
  std::vector<Closure> closures;  // all agree with each other; the frames are 300 m apart
  for (std::size_t k = 0; k < 8; ++k) closures.push_back(robots.True(7 * k, other + 7 * k + 2));
  Closure said{30, other + 30, robots.poses[30].inverse() * robots.poses[other + 30], 0.1, 0.01};
  said.T_i_j = said.T_i_j * Step(0.2, 2.0, 1.0, 0.5);
  closures.push_back(said);
  STRATA_ASSERT_OK_AND_ASSIGN(const ConsistentClosureSet set,
                              ConsistentClosures(robots.poses, robots.edges, closures));
  EXPECT_THAT(set.kept, ElementsAre(8));
}

// Frames that agree but for a storey's height, by places that look alike on every storey.
TEST(ClosureConsistencyTest, FramesAreNotLiftedByStoreys) {
  const TwoRobots robots(3);
  const std::size_t other = TwoRobots::kScans;
  const auto lifted = [&](const Eigen::Vector3d& by) {
    std::vector<Closure> closures;
    for (std::size_t k = 0; k < 6; ++k) {
      const Pose T_map_j = Pose(Eigen::Translation3d(by)) * robots.poses[other + 7 * k];
      closures.push_back(
          {7 * k, other + 7 * k, robots.poses[7 * k].inverse() * T_map_j, 0.1, 0.01});
    }
    const auto set = ConsistentClosures(robots.poses, robots.edges, closures);
    return set.ok() ? set->kept.size() : 99;
  };
  EXPECT_EQ(lifted({0.3, 0.2, 0.1}), 6U);
  EXPECT_EQ(lifted({0.3, 0.2, 3.2}), 0U);
  EXPECT_EQ(lifted({0.3, 0.2, -3.2}), 0U);
  EXPECT_EQ(lifted({0.3, 9.0, 3.2}), 6U) << "frames that have nothing to do with each other";
  EXPECT_EQ(lifted({0.3, 0.2, 40.0}), 6U) << "no storey";
}

TEST(ClosureConsistencyTest, WithinOneTrajectoryTheGraphItselfIsAsked) {
  TwoRobots robots(1);
  Closure fits = robots.True(0, 40);
  Closure contradicts = fits;
  contradicts.T_i_j.translation().z() += 30.0;
  STRATA_ASSERT_OK_AND_ASSIGN(
      const ConsistentClosureSet set,
      ConsistentClosures(robots.poses, robots.edges, std::vector<Closure>{contradicts, fits}));
  EXPECT_THAT(set.kept, ElementsAre(1));
}

// A ramp that winds up three times, 2.9 m each: what is seen on one turn is seen on the next.
class Helix {
 public:
  static constexpr std::size_t kTurn = 30;  // scans

  Helix() {
    const Matrix6d information = Vector6d(Vector6d::Constant(1.0 / (0.006 * 0.006))).asDiagonal();
    for (std::size_t k = 0; k < 3 * kTurn; ++k) {
      const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / kTurn;
      poses.push_back(Step(0.0, 15.0 * std::cos(angle), 15.0 * std::sin(angle), 2.9 * k / kTurn) *
                      Step(angle, 0.0, 0.0, 0.0));
      if (k > 0) edges.push_back({k - 1, k, information});
    }
  }

  // From `first` to a turn later, said to be `up_m` below where the graph has it.
  Closure OverATurn(std::size_t first, double up_m) const {
    const Pose T_map_j = Step(0.0, 0.0, 0.0, -up_m) * poses[first + kTurn];
    return {first, first + kTurn, poses[first].inverse() * T_map_j, 0.05, 0.005};
  }

  std::size_t Kept(const std::vector<Closure>& closures) const {
    const auto set = ConsistentClosures(poses, edges, closures);
    return set.ok() ? set->kept.size() : 99;
  }

  std::vector<Pose> poses;
  std::vector<GraphEdge> edges;
};

TEST(ClosureConsistencyTest, ATurnOfARampIsNotTheNextOne) {
  const Helix helix;
  const auto all_off_by = [&](double up_m) {
    std::vector<Closure> closures;
    for (std::size_t k = 30; k < 45; ++k) closures.push_back(helix.OverATurn(k, up_m));
    return helix.Kept(closures);
  };
  EXPECT_EQ(all_off_by(2.9), 0U);
  EXPECT_EQ(all_off_by(-2.9), 0U);
  EXPECT_EQ(all_off_by(1.0), 15U) << "drift";
}

// Whose graph would allow for it by its σ.
TEST(ClosureConsistencyTest, AStoreyIsNotTheNextOneWhereTheGraphErrsByLittleElsewhere) {
  Helix helix;
  for (GraphEdge& edge : helix.edges) edge.information *= 0.1;
  std::vector<Closure> closures;
  for (std::size_t k = 30; k < 45; ++k) closures.push_back(helix.OverATurn(k, 2.9));
  EXPECT_EQ(helix.Kept(closures), 15U) << "nothing says how well the graph is known";
  for (std::size_t k = 0; k < 7; ++k) closures.push_back(helix.OverATurn(k, 0.02));
  EXPECT_EQ(helix.Kept(closures), 22U) << "too few do";
  closures.push_back(helix.OverATurn(7, 0.02));
  EXPECT_EQ(helix.Kept(closures), 8U);
}

TEST(ClosureConsistencyTest, HoldsWherePosesAreNear) {
  const Pose T_map_i = Step(1.0, 30.0, -4.0, 2.0);
  const Pose T_i_j = Step(0.5, 3.0, 1.0, 0.0);
  EXPECT_TRUE(ClosureHolds(T_i_j, T_map_i, T_map_i * T_i_j * Step(0.04, 0.4, 0.0, 0.0)));
  EXPECT_FALSE(ClosureHolds(T_i_j, T_map_i, T_map_i * T_i_j * Step(0.06, 0.0, 0.0, 0.0)));
  EXPECT_FALSE(ClosureHolds(T_i_j, T_map_i, T_map_i * T_i_j * Step(0.0, 0.0, 0.4, 0.4)));
}

TEST(ClosureConsistencyTest, RefusesNonsense) {
  TwoRobots robots(1);
  Closure closure = robots.True(0, 70);
  closure.sigma_m = 0.0;
  const auto check = [&] {
    return ConsistentClosures(robots.poses, robots.edges, std::vector<Closure>{closure}).status();
  };
  EXPECT_THAT(check(), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("sigma_m 0")));
  closure = robots.True(0, 70);
  closure.j = 500;
  EXPECT_THAT(check(), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("closure 0 joins")));
  closure = robots.True(0, 70);
  closure.T_i_j.translation().x() = std::numeric_limits<double>::infinity();
  EXPECT_THAT(check(), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("closure 0")));
  EXPECT_THAT(ConsistentClosures({}, {}, {})->kept, IsEmpty());
}

}  // namespace
}  // namespace strata
