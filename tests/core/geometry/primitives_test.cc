#include "core/geometry/primitives.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::IsOkAndHolds;
using testing::StatusIs;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Eigen::Vector3d RandomVector(std::mt19937& random, double scale = 1.0) {
  std::normal_distribution<double> normal(0.0, scale);
  const double x = normal(random);
  const double y = normal(random);
  return {x, y, normal(random)};
}

Line RandomLine(std::mt19937& random) {
  return MakeLine(RandomVector(random, 5.0), RandomVector(random)).value();
}

// Least value of a convex function of one variable, by ternary search.
template <typename Function>
double Minimum(Function f, double low, double high) {
  for (int i = 0; i < 200; ++i) {
    const double a = low + (high - low) / 3.0;
    const double b = high - (high - low) / 3.0;
    (f(a) < f(b) ? high : low) = f(a) < f(b) ? b : a;
  }
  return f(0.5 * (low + high));
}

TEST(PrimitivesTest, MakersNormaliseAndRefuseWhatHasNoDirection) {
  const Line line = MakeLine({1, 2, 3}, {0, 0, -4}).value();
  EXPECT_EQ(line.direction, Eigen::Vector3d(0, 0, -1));
  // 2z = 6 is z = 3.
  const Plane plane = MakePlane({0, 0, 2}, 6.0).value();
  EXPECT_EQ(plane.normal, Eigen::Vector3d(0, 0, 1));
  EXPECT_DOUBLE_EQ(plane.distance, 3.0);
  EXPECT_THAT(MakeLine({0, 0, 0}, {0, 0, 0}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("direction (0, 0, 0)")));
  EXPECT_THAT(MakeLine({kNan, 0, 0}, {1, 0, 0}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("origin")));
  EXPECT_THAT(MakePlane({kNan, 0, 0}, 1.0),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("normal")));
  EXPECT_THAT(MakePlane({1, 0, 0}, kNan),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("distance")));
  EXPECT_THAT(MakePlane({0, 0, 1e-9}, 1e300),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("distance")));
}

TEST(PrimitivesTest, CanonicalKeepsThePointsAndFixesTheSign) {
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    const Plane plane = MakePlane(RandomVector(random), RandomVector(random).x()).value();
    const Plane canonical = Canonical(plane);
    EXPECT_GE(canonical.distance, 0.0);
    const Eigen::Vector3d q = RandomVector(random);
    EXPECT_DOUBLE_EQ(Distance(q, plane), Distance(q, canonical));
  }
  EXPECT_EQ(Canonical({-Eigen::Vector3d::UnitZ(), 0.0}).normal, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(Canonical({-Eigen::Vector3d::UnitX(), 0.0}).normal, Eigen::Vector3d::UnitX());
}

TEST(PrimitivesTest, BearingOfAxesAndBack) {
  const double right = std::numbers::pi / 2;
  EXPECT_NEAR(BearingOf(Eigen::Vector3d::UnitY()).azimuth_rad, right, 1e-15);
  // Where the thesis' own arctan is wrong: n_x < 0, n_y = 0.
  EXPECT_NEAR(BearingOf({-1.0, 0.0, 0.0}).azimuth_rad, std::numbers::pi, 1e-15);
  EXPECT_NEAR(BearingOf(-Eigen::Vector3d::UnitZ()).elevation_rad, -right, 1e-15);
  EXPECT_NEAR(BearingOf(Eigen::Vector3d::UnitZ()).azimuth_rad, 0.0, 1e-15);
  std::mt19937 random(4);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d n = RandomVector(random).normalized();
    EXPECT_LT((UnitVector(BearingOf(n)) - n).norm(), 1e-14);
  }
}

TEST(DistanceTest, PointToPointLineAndPlaneEqualBruteForce) {
  std::mt19937 random(5);
  for (int i = 0; i < 50; ++i) {
    SCOPED_TRACE(i);
    const Eigen::Vector3d q = RandomVector(random, 5.0);
    const Line line = RandomLine(random);
    const auto to_line = [&](double s) { return (line.origin + s * line.direction - q).norm(); };
    EXPECT_NEAR(Distance(q, line), Minimum(to_line, -100.0, 100.0), 1e-6);
    EXPECT_DOUBLE_EQ(Distance(q, line.origin), to_line(0.0));

    // The plane spanned by two directions at a point, minimised over both coordinates.
    const Eigen::Vector3d p = RandomVector(random, 5.0);
    const Eigen::Vector3d u = RandomVector(random).normalized();
    const Eigen::Vector3d v = u.unitOrthogonal();
    const Plane plane = MakePlane(u.cross(v), u.cross(v).dot(p)).value();
    const auto to_plane = [&](double s) {
      return Minimum([&](double t) { return (p + s * u + t * v - q).norm(); }, -100.0, 100.0);
    };
    EXPECT_NEAR(Distance(q, plane), Minimum(to_plane, -100.0, 100.0), 1e-6);
    EXPECT_NEAR(
        SignedDistance(q + 2.0 * plane.normal, plane), SignedDistance(q, plane) + 2.0, 1e-12);
  }
}

TEST(DistanceTest, LineToLineEqualsBruteForceAlsoWhenParallel) {
  std::mt19937 random(6);
  for (int i = 0; i < 50; ++i) {
    SCOPED_TRACE(i);
    const Line a = RandomLine(random);
    Line b = RandomLine(random);
    if (i % 3 == 0) b.direction = i % 2 == 0 ? a.direction : Eigen::Vector3d(-a.direction);
    const auto to_b = [&](double s) {
      const Eigen::Vector3d p = a.origin + s * a.direction;
      return Minimum([&](double t) { return (b.origin + t * b.direction - p).norm(); }, -1e3, 1e3);
    };
    EXPECT_NEAR(Distance(a, b), Minimum(to_b, -1e3, 1e3), 1e-5);
    EXPECT_NEAR(Distance(a, b), Distance(b, a), 1e-12);
  }
}

TEST(DistanceTest, LineToPlaneExistsForParallelOnesOnly) {
  const Plane floor = {Eigen::Vector3d::UnitZ(), 1.0};
  EXPECT_THAT(Distance(Line{{5, 5, 3}, {0.6, 0.8, 0}}, floor),
              IsOkAndHolds(::testing::DoubleEq(2.0)));
  const Line tilted = MakeLine({5, 5, 3}, {1, 0, 0.01}).value();
  EXPECT_THAT(Distance(tilted, floor),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("from parallel")));
  EXPECT_THAT(Distance(tilted, floor, 0.02), IsOkAndHolds(::testing::DoubleEq(2.0)));
}

TEST(DistanceTest, PlaneToPlaneMindsTheirNormals) {
  const Plane floor = {Eigen::Vector3d::UnitZ(), 1.0};
  const Plane ceiling = {Eigen::Vector3d::UnitZ(), 3.5};
  const Plane ceiling_down = {-Eigen::Vector3d::UnitZ(), -3.5};
  EXPECT_THAT(Distance(floor, ceiling), IsOkAndHolds(::testing::DoubleEq(2.5)));
  EXPECT_THAT(Distance(floor, ceiling_down), IsOkAndHolds(::testing::DoubleEq(2.5)));
  EXPECT_THAT(Distance(ceiling_down, floor), IsOkAndHolds(::testing::DoubleEq(2.5)));
  EXPECT_THAT(Distance(floor, Plane{Eigen::Vector3d::UnitX(), 1.0}),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("two planes: 1.57")));
}

}  // namespace
}  // namespace strata
