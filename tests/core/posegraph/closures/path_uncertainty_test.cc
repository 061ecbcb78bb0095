#include "core/posegraph/closures/path_uncertainty.h"

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::ElementsAre;
using testing::StatusIs;

constexpr DriftOptions kNoDrift{0.0, 0.0};

Matrix6d InformationOf(double sigma_rad, double sigma_m) {
  Vector6d diagonal;
  diagonal.head<3>().setConstant(1.0 / (sigma_rad * sigma_rad));
  diagonal.tail<3>().setConstant(1.0 / (sigma_m * sigma_m));
  return diagonal.asDiagonal();
}

// A winding way of `n` poses, 2 m apart.
std::vector<Pose> Way(int n) {
  std::vector<Pose> poses = {Pose::Identity()};
  for (int i = 1; i < n; ++i) {
    Vector6d step;
    step << 0.0, 0.02, 0.1 * std::sin(0.3 * i), 2.0, 0.0, 0.0;
    poses.push_back(Retract(poses.back(), step));
  }
  return poses;
}

std::vector<GraphEdge> Chain(std::size_t n, const Matrix6d& information) {
  std::vector<GraphEdge> edges;
  for (std::size_t i = 0; i + 1 < n; ++i) edges.push_back({i, i + 1, information});
  return edges;
}

// Against the spread of many noisy copies of the chain.
TEST(PathUncertaintyTest, GrowsAlongAChainAsNoiseDoes) {
  const unsigned seed = 3;
  SCOPED_TRACE(seed);
  constexpr double kSigmaRad = 0.01;
  constexpr double kSigmaM = 0.05;
  const std::vector<Pose> poses = Way(40);
  const auto known =
      PathUncertainties(poses, Chain(40, InformationOf(kSigmaRad, kSigmaM)), kNoDrift).From(0);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> squares_m(40, 0.0);
  std::vector<double> squares_rad(40, 0.0);
  constexpr int kRuns = 2000;
  for (int run = 0; run < kRuns; ++run) {
    Pose noisy = poses[0];
    for (std::size_t i = 1; i < poses.size(); ++i) {
      Vector6d step;
      for (int k = 0; k < 6; ++k) step[k] = normal(random) * (k < 3 ? kSigmaRad : kSigmaM);
      noisy = noisy * Retract(poses[i - 1].inverse() * poses[i], step);
      squares_m[i] += (noisy.translation() - poses[i].translation()).squaredNorm();
      const double angle = RotationAngleRad(poses[i].inverse() * noisy);
      squares_rad[i] += angle * angle;
    }
  }
  for (const std::size_t i : {1U, 5U, 20U, 39U}) {
    ASSERT_TRUE(known[i].connected);
    EXPECT_NEAR(known[i].sigma_m / std::sqrt(squares_m[i] / kRuns), 1.0, 0.06) << i;
    EXPECT_NEAR(known[i].sigma_rad / std::sqrt(squares_rad[i] / kRuns), 1.0, 0.06) << i;
    EXPECT_EQ(known[i].hops, static_cast<int>(i));
    EXPECT_NEAR(known[i].way_m, 2.0 * static_cast<double>(i), 1e-9);
  }
}

TEST(PathUncertaintyTest, AClosureMakesBothEndsSure) {
  const std::vector<Pose> poses = Way(30);
  std::vector<GraphEdge> edges = Chain(30, InformationOf(0.01, 0.05));
  const auto open = PathUncertainties(poses, edges, kNoDrift).From(0);
  edges.push_back({29, 0, InformationOf(0.005, 0.02)});
  const auto closed = PathUncertainties(poses, edges, kNoDrift).From(0);
  EXPECT_EQ(closed[29].hops, 1);
  EXPECT_NEAR(closed[29].sigma_m, 0.02 * std::sqrt(3.0), 1e-3);
  EXPECT_LT(closed[27].sigma_m, 0.2 * open[27].sigma_m);
  EXPECT_EQ(closed[3].sigma_m, open[3].sigma_m);
}

TEST(PathUncertaintyTest, DriftIsAddedByTheWay) {
  const std::vector<Pose> poses = Way(26);
  const auto known =
      PathUncertainties(poses, Chain(26, InformationOf(1e-6, 1e-6)), {0.02, 0.0}).From(0);
  EXPECT_NEAR(known[25].sigma_m, 0.02 * std::sqrt(50.0), 1e-3);
}

TEST(PathUncertaintyTest, PartsAreToldApart) {
  const std::vector<Pose> poses = Way(5);
  const GraphEdge edges[] = {{1, 0, InformationOf(1, 1)}, {3, 4, InformationOf(1, 1)}};
  const PathUncertainties graph(poses, edges);
  EXPECT_FALSE(graph.From(0)[3].connected);
  EXPECT_TRUE(graph.From(4)[3].connected);
  EXPECT_THAT(graph.Parts(), ElementsAre(0, 0, 2, 3, 3));
}

TEST(PathUncertaintyTest, EdgesThatSayNothingOrNonsenseAreHarmless) {
  const std::vector<Pose> poses = Way(3);
  const GraphEdge edges[] = {{0, 1, Matrix6d::Zero()},
                             {1, 2, Matrix6d::Constant(std::numeric_limits<double>::quiet_NaN())}};
  const auto known = PathUncertainties(poses, edges).From(0);
  EXPECT_TRUE(known[1].connected);
  EXPECT_GT(known[1].sigma_m, 50.0);
  EXPECT_FALSE(known[2].connected);
}

TEST(PathUncertaintyTest, NamesWhatIsOutOfRange) {
  EXPECT_THAT((DriftOptions{-1.0, 0.0}).Validate(),
              StatusIs(absl::StatusCode::kInvalidArgument, ::testing::HasSubstr("drift_m is -1")));
}

}  // namespace
}  // namespace strata
