#include "core/planes/moments.h"

#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/geometry/plane_fit.h"
#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"

namespace strata {
namespace {

std::vector<Eigen::Vector3d> RandomPoints(std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 50; ++i) {
    const double x = normal(random);
    const double y = normal(random);
    points.emplace_back(20.0 + 3.0 * x, -7.0 + y, 1.0 + 0.2 * x + 0.1 * normal(random));
  }
  return points;
}

Eigen::Matrix4d SumOf(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const Eigen::Vector3d& p : points) sum += MomentsOf(1.0, p, Eigen::Matrix3d::Zero());
  return sum;
}

TEST(MomentsTest, FitIsThatOfThePoints) {
  std::mt19937 random(1);
  const std::vector<Eigen::Vector3d> points = RandomPoints(random);
  const PointsPlaneFit expected = FitPlaneToPoints(points).value();
  const MomentsFit fit = FitMoments(SumOf(points));
  EXPECT_LT((fit.mean - expected.mean).norm(), 1e-9);
  EXPECT_NEAR(std::abs(fit.plane.normal.dot(expected.plane.normal)), 1.0, 1e-9);
  EXPECT_LT((fit.eigenvalues - expected.eigenvalues).norm(), 1e-9);
  EXPECT_NEAR(Distance(expected.mean, fit.plane), 0.0, 1e-9);
}

TEST(MomentsTest, RmsDistanceIsThatOfThePoints) {
  std::mt19937 random(2);
  const std::vector<Eigen::Vector3d> points = RandomPoints(random);
  const Plane plane = MakePlane({0.1, 0.2, 0.9}, 3.0).value();
  double sum = 0.0;
  for (const Eigen::Vector3d& p : points) sum += std::pow(SignedDistance(p, plane), 2);
  EXPECT_NEAR(RmsDistance(SumOf(points), plane), std::sqrt(sum / 50.0), 1e-9);
}

TEST(MomentsTest, MovingMomentsIsMovingPoints) {
  std::mt19937 random(3);
  std::vector<Eigen::Vector3d> points = RandomPoints(random);
  const Eigen::Matrix4d before = SumOf(points);
  const Pose T = Retract(Pose::Identity(), Vector6d::LinSpaced(-0.5, 2.0));
  for (Eigen::Vector3d& p : points) p = T * p;
  EXPECT_LT((Moved(T, before) - SumOf(points)).norm(), 1e-7);
}

}  // namespace
}  // namespace strata
