#include "core/geometry/plane_fit.h"

#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/geometry/primitives.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

Eigen::Vector3d RandomVector(std::mt19937& random, double scale = 1.0) {
  std::normal_distribution<double> normal(0.0, scale);
  const double x = normal(random);
  const double y = normal(random);
  return {x, y, normal(random)};
}

double MeanSquare(std::span<const Eigen::Vector3d> points,
                  std::span<const double> weights,
                  const Plane& plane) {
  double sum = 0.0;
  double sum_w = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double w = weights.empty() ? 1.0 : weights[i];
    sum += w * std::pow(SignedDistance(points[i], plane), 2);
    sum_w += w;
  }
  return sum / sum_w;
}

// No plane near the fitted one, nor any of many all over the sphere, does better.
void ExpectOptimal(std::span<const Eigen::Vector3d> points,
                   std::span<const double> weights,
                   const PointsPlaneFit& fit,
                   std::mt19937& random) {
  const double best = MeanSquare(points, weights, fit.plane);
  EXPECT_NEAR(best, fit.mean_squared_residual_m2, 1e-9 * fit.eigenvalues(2));
  for (int i = 0; i < 400; ++i) {
    const bool near = i < 200;
    const Eigen::Vector3d n = near ? Eigen::Vector3d(fit.plane.normal + RandomVector(random, 0.01))
                                   : RandomVector(random);
    const double d = n.dot(fit.mean) + (near ? RandomVector(random, 0.01).x() : 0.0);
    EXPECT_GE(MeanSquare(points, weights, MakePlane(n, d).value()), best - 1e-12);
  }
}

TEST(PlaneFitTest, PointsFitHasTheLeastMeanSquareOfAllPlanes) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.1, 5.0);
  for (int trial = 0; trial < 20; ++trial) {
    SCOPED_TRACE(::testing::Message() << "seed 1, trial " << trial);
    std::vector<Eigen::Vector3d> points(3 + trial);
    for (Eigen::Vector3d& p : points) {
      p = RandomVector(random).cwiseProduct(Eigen::Vector3d(4.0, 2.0, 0.5)) +
          Eigen::Vector3d(7, 8, 9);
    }
    std::vector<double> weights;
    if (trial % 2 == 1) {
      for (std::size_t i = 0; i < points.size(); ++i) weights.push_back(uniform(random));
    }
    STRATA_ASSERT_OK_AND_ASSIGN(const PointsPlaneFit fit, FitPlaneToPoints(points, weights));
    ExpectOptimal(points, weights, fit, random);
    EXPECT_NEAR(SignedDistance(fit.mean, fit.plane), 0.0, 1e-12);
    EXPECT_GE(fit.plane.distance, 0.0);
  }
}

TEST(PlaneFitTest, PlantedPlaneIsFoundFarFromTheOriginAndResidualIsTheNoise) {
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0.0, 0.01);
  const Plane truth = MakePlane({1, -2, 0.5}, 1e6).value();
  const Eigen::Vector3d u = truth.normal.unitOrthogonal();
  const Eigen::Vector3d v = truth.normal.cross(u);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector3d r = RandomVector(random, 3.0);
    points.emplace_back(truth.distance * truth.normal + r.x() * u + r.y() * v +
                        noise(random) * truth.normal);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const PointsPlaneFit fit, FitPlaneToPoints(points));
  EXPECT_LT(fit.plane.normal.cross(truth.normal).norm(), 3e-4);
  EXPECT_NEAR(std::sqrt(fit.mean_squared_residual_m2), 0.01, 0.0005);
  EXPECT_NEAR(SignedDistance(truth.distance * truth.normal, fit.plane), 0.0, 1e-3);
}

TEST(PlaneFitTest, PointOfWeightZeroCountsForNothing) {
  const std::vector<Eigen::Vector3d> points = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {0.3, 0.3, 50}};
  STRATA_ASSERT_OK_AND_ASSIGN(const PointsPlaneFit fit,
                              FitPlaneToPoints(points, std::vector<double>{1, 2, 1, 0}));
  EXPECT_LT((fit.plane.normal - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_NEAR(fit.plane.distance, 1.0, 1e-12);
  EXPECT_LT((fit.mean - Eigen::Vector3d(0.5, 0.25, 1.0)).norm(), 1e-12);
}

TEST(PlaneFitTest, PointsWithoutAPlaneAreRefused) {
  const auto refused = [](const std::vector<Eigen::Vector3d>& points,
                          const std::vector<double>& weights,
                          const char* why) {
    EXPECT_THAT(FitPlaneToPoints(points, weights),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(why)));
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused({{0, 0, 0}, {1, 1, 1}}, {}, "2 points, at least 3");
  refused({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {5, 5, 5}}, {}, "4 points lie on one line");
  refused({{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}, {}, "lie on one line");
  refused({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {1, 1}, "2 weights for 3 points");
  refused({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {1, 1, -1}, "weight 2 = -1");
  refused({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 0, 0}, "all weights are 0");
  refused({{0, 0, 0}, {1, 0, 0}, {0, nan, 0}}, {}, "point 2 is not finite");
  refused({{0, 0, 0}, {1e200, 0, 0}, {0, 1e200, 0}}, {}, "too far apart");
}

// Lines in a planted plane, through random points of it, with directions within `spread` of u.
std::vector<Line> LinesIn(const Plane& plane, double spread, double off_m, std::mt19937& random) {
  const Eigen::Vector3d u = plane.normal.unitOrthogonal();
  const Eigen::Vector3d v = plane.normal.cross(u);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Line> lines;
  for (int i = 0; i < 12; ++i) {
    const double angle = spread * uniform(random);
    const Eigen::Vector3d origin = plane.distance * plane.normal + 4.0 * uniform(random) * u +
                                   4.0 * uniform(random) * v +
                                   off_m * uniform(random) * plane.normal;
    lines.push_back({origin, std::cos(angle) * u + std::sin(angle) * v});
  }
  return lines;
}

TEST(PlaneFitTest, LinesInAPlaneGiveThatPlane) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const Plane truth = Canonical(MakePlane(RandomVector(random), 2.0 + trial).value());
    STRATA_ASSERT_OK_AND_ASSIGN(const LinesPlaneFit fit,
                                FitPlaneToLines(LinesIn(truth, 1.5, 0.0, random)));
    EXPECT_FALSE(fit.from_points);
    EXPECT_LT((fit.plane.normal - truth.normal).norm(), 1e-9);
    EXPECT_NEAR(fit.plane.distance, truth.distance, 1e-9);
  }
}

TEST(PlaneFitTest, NormalAndPointMinimiseTheirSums) {
  std::mt19937 random(4);
  std::vector<Line> lines;
  lines.reserve(12);
  for (int i = 0; i < 8; ++i) {
    lines.push_back(MakeLine(RandomVector(random, 3.0),
                             RandomVector(random).cwiseProduct(Eigen::Vector3d(1, 1, 0.2)))
                        .value());
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const LinesPlaneFit fit, FitPlaneToLines(lines));
  const auto residual = [&](const Eigen::Vector3d& n) {
    double sum = 0.0;
    for (const Line& line : lines) sum += std::pow(line.direction.dot(n.normalized()), 2);
    return sum;
  };
  const auto spread = [&](const Eigen::Vector3d& q) {
    double sum = 0.0;
    for (const Line& line : lines) sum += std::pow(Distance(q, line), 2);
    return sum;
  };
  EXPECT_NEAR(std::sqrt(residual(fit.plane.normal)), fit.singular_values(2), 1e-7);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d step = RandomVector(random, i < 250 ? 0.01 : 2.0);
    EXPECT_GE(residual(fit.plane.normal + step), residual(fit.plane.normal) - 1e-12);
    EXPECT_GE(spread(fit.point + step), spread(fit.point) - 1e-12);
  }
  EXPECT_NEAR(SignedDistance(fit.point, fit.plane), 0.0, 1e-12);
}

TEST(PlaneFitTest, NearlyParallelLinesAreFittedByTheirPoints) {
  // Rows of windows: 12 lines along u, directions known to 1°. Their normal alone is worthless.
  std::mt19937 random(5);
  const Plane truth = Canonical(MakePlane({1, 0.2, 0}, 6.0).value());
  const std::vector<Line> rows = LinesIn(truth, 0.02, 0.01, random);
  std::vector<Eigen::Vector3d> edgels;
  for (const Line& line : rows) {
    for (int k = -20; k <= 20; ++k) edgels.emplace_back(line.origin + 0.2 * k * line.direction);
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const LinesPlaneFit by_edgels, FitPlaneToLines(rows, edgels));
  EXPECT_TRUE(by_edgels.from_points);
  EXPECT_LT(by_edgels.plane.normal.cross(truth.normal).norm(), 0.01);
  EXPECT_NEAR(by_edgels.plane.distance, truth.distance, 0.01);
  STRATA_ASSERT_OK_AND_ASSIGN(const PointsPlaneFit oracle, FitPlaneToPoints(edgels));
  EXPECT_EQ(by_edgels.plane.normal, oracle.plane.normal);
  EXPECT_EQ(by_edgels.point, oracle.mean);
  STRATA_ASSERT_OK_AND_ASSIGN(const LinesPlaneFit alone, FitPlaneToLines(rows));
  EXPECT_TRUE(alone.from_points);
  EXPECT_LT(alone.plane.normal.cross(truth.normal).norm(), 0.02);
}

TEST(PlaneFitTest, TwoLinesCrossAtTheDocumentedAngle) {
  for (const double angle : {0.18, 0.22}) {
    const std::vector<Line> cross = {{{0, 0, 1}, {1, 0, 0}},
                                     {{0, 0, 1}, {std::cos(angle), std::sin(angle), 0}}};
    STRATA_ASSERT_OK_AND_ASSIGN(const LinesPlaneFit fit, FitPlaneToLines(cross));
    EXPECT_EQ(fit.from_points, angle < 2.0 * std::atan(0.1));
    EXPECT_LT((fit.plane.normal - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
    EXPECT_NEAR(fit.plane.distance, 1.0, 1e-9);
  }
}

TEST(PlaneFitTest, LinesWithoutAPlaneAreRefused) {
  const Line line;
  EXPECT_THAT(FitPlaneToLines(std::vector<Line>{line}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("1 lines, at least 2")));
  EXPECT_THAT(FitPlaneToLines(std::vector<Line>{line, line}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("one line")));
  Line broken = line;
  broken.direction.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(FitPlaneToLines(std::vector<Line>{line, broken}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("not finite")));
}

}  // namespace
}  // namespace strata
