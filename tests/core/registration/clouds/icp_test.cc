#include "core/registration/clouds/icp.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <ostream>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/registration/clouds/extrapolation.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using testing::StatusIs;

// Three walls' corner and a slanted board, sampled with noise, as seen from a sensor 4 m away.
PointCloud Corner(int n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> u(0.0, 4.0);
  std::normal_distribution<double> noise(0.0, 0.003);
  PointCloud cloud;
  cloud.sensor_origin = {6.0F, 6.0F, 5.0F};
  for (int i = 0; i < n; ++i) {
    const double a = u(random);
    const double b = u(random);
    const double c = noise(random);
    const Eigen::Vector3d faces[] = {
        {a, b, c}, {a, c, b}, {c, a, b}, {1.0 + 0.2 * a, 1.0 + 0.3 * b, 0.5 + 0.1 * (a + b) + c}};
    cloud.points.push_back(faces[i % 4].cast<float>());
  }
  return cloud;
}

PointCloud Moved(const PointCloud& cloud, const Pose& T) {
  PointCloud moved = cloud;
  for (Eigen::Vector3f& p : moved.points) p = (T * p.cast<double>()).cast<float>();
  moved.sensor_origin = (T * cloud.sensor_origin.cast<double>()).cast<float>();
  return moved;
}

Pose SmallPose() {
  Vector6d step;
  step << 0.04, -0.03, 0.05, 0.10, -0.08, 0.06;
  return Retract(Pose::Identity(), step);
}

double ErrorOf(const Pose& T, const Pose& truth) {
  const Pose error = truth.inverse() * T;
  return error.translation().norm() + RotationAngleRad(error);
}

struct Choice {
  std::string name;
  IcpOptions options;
  double bound;  // metres plus radians
};

void PrintTo(const Choice& choice, std::ostream* out) { *out << choice.name; }

IcpOptions With(void (*change)(IcpOptions&)) {
  IcpOptions options;
  options.max_iterations = 200;
  change(options);
  return options;
}

class IcpChoicesTest : public ::testing::TestWithParam<Choice> {};

TEST_P(IcpChoicesTest, PlantedPoseIsFound) {
  const PointCloud target = Corner(6000, 1);
  const Pose truth = SmallPose();
  const PointCloud source = Moved(Corner(3000, 2), truth.inverse());
  STRATA_ASSERT_OK_AND_ASSIGN(const RegistrationResult r,
                              RegisterClouds(source, target, Pose::Identity(), GetParam().options));
  EXPECT_LT(ErrorOf(r.T_target_source, truth), GetParam().bound) << ToString(r.termination);
  EXPECT_GT(r.overlap, 0.3);
  EXPECT_THAT(r.degenerate_directions, IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    Choices,
    IcpChoicesTest,
    ::testing::Values(
        Choice{"PointToPoint", With([](IcpOptions&) {}), 0.03},
        Choice{"PointToPlane",
               With([](IcpOptions& o) { o.metric = IcpMetric::kPointToPlane; }),
               0.003},
        Choice{"PlaneToPlane",
               With([](IcpOptions& o) { o.metric = IcpMetric::kPlaneToPlane; }),
               0.003},
        Choice{"EveryNth",
               With([](IcpOptions& o) {
                 o.selection = IcpSelection::kEveryNth;
                 o.max_points = 800;
               }),
               0.03},
        Choice{"Random",
               With([](IcpOptions& o) {
                 o.selection = IcpSelection::kRandom;
                 o.max_points = 800;
               }),
               0.03},
        Choice{"Projection",
               With([](IcpOptions& o) {
                 o.matching = IcpMatching::kProjection;
                 o.projection_cell_rad = 0.02;
                 o.metric = IcpMetric::kPointToPlane;
                 o.max_normal_angle_rad = 0.5;
               }),
               0.03},
        Choice{"DistanceWeights",
               With([](IcpOptions& o) { o.weighting = IcpWeighting::kDistance; }),
               0.03},
        Choice{"NormalWeights",
               With([](IcpOptions& o) { o.weighting = IcpWeighting::kNormalCompatibility; }),
               0.03},
        Choice{"Trimmed", With([](IcpOptions& o) { o.keep_share = 0.8; }), 0.03},
        Choice{"Mutual", With([](IcpOptions& o) { o.mutual = true; }), 0.03},
        Choice{"Linear",
               With([](IcpOptions& o) { o.extrapolation = IcpExtrapolation::kLinear; }),
               0.03},
        Choice{"Quadratic",
               With([](IcpOptions& o) { o.extrapolation = IcpExtrapolation::kQuadratic; }),
               0.03}),
    [](const auto& choice) { return choice.param.name; });

TEST(IcpTest, ExtrapolationSavesIterations) {
  const PointCloud target = Corner(6000, 1);
  const PointCloud source = Moved(Corner(3000, 2), SmallPose().inverse());
  IcpOptions options;
  options.max_iterations = 500;
  STRATA_ASSERT_OK_AND_ASSIGN(const RegistrationResult plain,
                              RegisterClouds(source, target, Pose::Identity(), options));
  options.extrapolation = IcpExtrapolation::kQuadratic;
  STRATA_ASSERT_OK_AND_ASSIGN(const RegistrationResult extrapolated,
                              RegisterClouds(source, target, Pose::Identity(), options));
  EXPECT_LT(extrapolated.iterations, plain.iterations);
}

TEST(IcpTest, InverseProblemGivesTheInversePose) {
  const PointCloud a = Corner(4000, 1);
  const PointCloud b = Moved(Corner(4000, 2), SmallPose().inverse());
  IcpOptions options;
  options.metric = IcpMetric::kPointToPlane;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto forward, RegisterClouds(b, a, Pose::Identity(), options));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto backward, RegisterClouds(a, b, Pose::Identity(), options));
  EXPECT_LT(ErrorOf(forward.T_target_source, backward.T_target_source.inverse()), 0.003);
}

TEST(IcpTest, OutliersAreTrimmed) {
  const PointCloud target = Corner(6000, 1);
  const Pose truth = SmallPose();
  PointCloud source = Moved(Corner(2000, 2), truth.inverse());
  std::mt19937_64 random(3);
  std::uniform_real_distribution<float> u(-0.6F, -0.4F);
  for (int i = 0; i < 600; ++i) source.points.emplace_back(4 * u(random), u(random), u(random));
  IcpOptions options;
  options.max_iterations = 200;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto all,
                              RegisterClouds(source, target, Pose::Identity(), options));
  options.keep_share = 0.75;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto trimmed,
                              RegisterClouds(source, target, Pose::Identity(), options));
  EXPECT_LT(ErrorOf(trimmed.T_target_source, truth), 0.03);
  EXPECT_LT(ErrorOf(trimmed.T_target_source, truth), ErrorOf(all.T_target_source, truth));
}

TEST(IcpTest, PairsWhoseNormalsDifferAreLeftOut) {
  PointCloud floor;
  PointCloud wall;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<float> u(-0.5F, 0.5F);
  for (int i = 0; i < 1000; ++i) {
    floor.points.emplace_back(u(random), u(random), 0.0F);
    wall.points.emplace_back(0.0F, u(random), u(random));
  }
  IcpOptions options;
  options.max_distance_m = 2.0;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto all,
                              RegisterClouds(wall, floor, Pose::Identity(), options));
  EXPECT_GT(all.overlap, 0.9);
  options.max_normal_angle_rad = 0.5;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto none,
                              RegisterClouds(wall, floor, Pose::Identity(), options));
  EXPECT_EQ(none.termination, Termination::kTooLittleOverlap);
  EXPECT_LT(none.overlap, 0.1);
}

TEST(IcpTest, PlaneLeavesThreeDirectionsUndetermined) {
  PointCloud plane;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<float> u(-5.0F, 5.0F);
  for (int i = 0; i < 2000; ++i) plane.points.emplace_back(u(random), u(random), 0.0F);
  IcpOptions options;
  options.metric = IcpMetric::kPointToPlane;
  const Pose guess = MakePose(Eigen::Quaterniond::Identity(), {0.1, 0.0, 0.2});
  STRATA_ASSERT_OK_AND_ASSIGN(const auto r, RegisterClouds(plane, plane, guess, options));
  EXPECT_EQ(r.termination, Termination::kDegenerate);
  EXPECT_THAT(r.degenerate_directions, SizeIs(3));
  // Moved onto the plane, not within it.
  EXPECT_TRUE(r.T_target_source.translation().isApprox(Eigen::Vector3d(0.1, 0, 0), 1e-3));
}

TEST(IcpTest, FarApartIsTooLittleOverlap) {
  const PointCloud cloud = Corner(500, 1);
  const Pose guess = MakePose(Eigen::Quaterniond::Identity(), {100, 0, 0});
  STRATA_ASSERT_OK_AND_ASSIGN(const auto r, RegisterClouds(cloud, cloud, guess));
  EXPECT_EQ(r.termination, Termination::kTooLittleOverlap);
  EXPECT_TRUE(r.T_target_source.isApprox(guess));
}

TEST(IcpTest, CloudsWithoutPointsOverlapWithNothing) {
  PointCloud holes;
  holes.rows = 1;
  holes.columns = 2;
  holes.points.assign(2, Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  for (const IcpMatching matching : {IcpMatching::kClosestPoint, IcpMatching::kProjection}) {
    IcpOptions options;
    options.matching = matching;
    STRATA_ASSERT_OK_AND_ASSIGN(const auto r,
                                RegisterClouds(holes, Corner(100, 1), Pose::Identity(), options));
    EXPECT_EQ(r.termination, Termination::kTooLittleOverlap);
    STRATA_ASSERT_OK_AND_ASSIGN(const auto s,
                                RegisterClouds(Corner(100, 1), holes, Pose::Identity(), options));
    EXPECT_EQ(s.termination, Termination::kTooLittleOverlap);
  }
}

TEST(IcpTest, FarOriginsLoseNothing) {
  PointCloud target = Corner(4000, 1);
  PointCloud source = Moved(Corner(4000, 2), SmallPose().inverse());
  IcpOptions options;
  options.metric = IcpMetric::kPointToPlane;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto near,
                              RegisterClouds(source, target, Pose::Identity(), options));
  const Eigen::Vector3d utm(450000.0, 5400000.0, 300.0);
  target.origin = utm;
  const Pose guess(Eigen::Translation3d{utm});
  STRATA_ASSERT_OK_AND_ASSIGN(const auto far, RegisterClouds(source, target, guess, options));
  EXPECT_LT(ErrorOf(guess.inverse() * far.T_target_source, near.T_target_source), 1e-6);
}

TEST(IcpTest, LeavingTheBoundsIsDiverged) {
  const PointCloud target = Corner(3000, 1);
  const PointCloud source = Moved(Corner(1500, 2), SmallPose().inverse());
  IcpOptions options;
  options.max_translation_m = 0.01;
  STRATA_ASSERT_OK_AND_ASSIGN(const auto r,
                              RegisterClouds(source, target, Pose::Identity(), options));
  EXPECT_EQ(r.termination, Termination::kDiverged);
  EXPECT_TRUE(r.T_target_source.isApprox(Pose::Identity()));
}

TEST(IcpTest, InvalidOptionsNameEveryViolation) {
  IcpOptions options;
  options.keep_share = 0.0;
  options.max_distance_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(RegisterClouds(PointCloud(), PointCloud(), Pose::Identity(), options),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       AllOf(HasSubstr("keep_share is 0"), HasSubstr("max_distance_m is nan"))));
}

TEST(IcpTest, ProjectionHasNoMutualPairs) {
  IcpOptions options;
  options.matching = IcpMatching::kProjection;
  options.mutual = true;
  EXPECT_THAT(RegisterClouds(PointCloud(), PointCloud(), Pose::Identity(), options),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("projection")));
}

TEST(IcpTest, TooFewPointsForPlanesAreTooLittleOverlap) {
  PointCloud few;
  for (int i = 0; i < 5; ++i) few.points.emplace_back(i, i * i, 0.0F);
  IcpOptions options;
  options.metric = IcpMetric::kPlaneToPlane;
  const Pose guess = MakePose(Eigen::Quaterniond::Identity(), {0.1, 0.0, 0.0});
  STRATA_ASSERT_OK_AND_ASSIGN(const auto r, RegisterClouds(few, few, guess, options));
  EXPECT_EQ(r.termination, Termination::kTooLittleOverlap);
  EXPECT_TRUE(r.T_target_source.isApprox(guess));
}

TEST(StepExtrapolatorTest, ParabolaFindsItsMinimum) {
  // Error (v − 10)² + 1 along x, visited at 1, 2 and 3: seven more to go.
  StepExtrapolator extrapolator(true, 100.0, 1.0);
  Vector6d step = Vector6d::Zero();
  step[3] = 1.0;
  EXPECT_TRUE(extrapolator.Extend(step, 82.0).isZero());
  extrapolator.Extend(step, 65.0);
  EXPECT_NEAR(extrapolator.Extend(step, 50.0)[3], 7.0, 1e-9);
}

TEST(StepExtrapolatorTest, TurningStepsAreNotExtrapolated) {
  StepExtrapolator extrapolator(true, 100.0, 1.0);
  extrapolator.Extend(Vector6d::Unit(3), 2.0);
  EXPECT_TRUE(extrapolator.Extend(Vector6d::Unit(4), 1.0).isZero());
}

}  // namespace
}  // namespace strata
