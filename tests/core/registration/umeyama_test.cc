#include "core/registration/umeyama.h"

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata {
namespace {

using Points = std::vector<Eigen::Vector3d>;

class UmeyamaTest : public ::testing::TestWithParam<std::uint64_t> {
 protected:
  void SetUp() override {
    RecordProperty("seed", static_cast<int>(GetParam()));
    random_.seed(GetParam());
  }
  Eigen::Vector3d Gaussian(double sx, double sy, double sz) {
    return {sx * normal_(random_), sy * normal_(random_), sz * normal_(random_)};
  }
  Points Cloud(int n, double sx, double sy, double sz) {
    const Eigen::Vector3d offset = Gaussian(5, 5, 5);
    Points points;
    for (int i = 0; i < n; ++i) points.push_back(offset + Gaussian(sx, sy, sz));
    return points;
  }
  Pose AnyPose() {
    const Eigen::Vector4d q(normal_(random_), normal_(random_), normal_(random_), normal_(random_));
    return MakePose(Eigen::Quaterniond(q).normalized(), Gaussian(10, 10, 10));
  }
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

Points Moved(const Pose& T, const Points& x) {
  Points y;
  for (const Eigen::Vector3d& p : x) y.push_back(T * p);
  return y;
}

double Cost(const Pose& T, const Points& x, const Points& y, const std::vector<double>& w) {
  double cost = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) cost += w[i] * (y[i] - T * x[i]).squaredNorm();
  return cost;
}

TEST_P(UmeyamaTest, PlantedTransformIsFound) {
  const Points x = Cloud(50, 3, 2, 1);
  const Pose truth = AnyPose();
  const UmeyamaResult fit = FitRigidTransform(x, Moved(truth, x));
  EXPECT_TRUE(fit.T_y_x.isApprox(truth, 1e-9));
  EXPECT_EQ(fit.spread, PointSpread::kVolume);
  EXPECT_THAT(fit.degenerate_directions, ::testing::IsEmpty());
  EXPECT_NEAR(fit.rms_m, 0.0, 1e-9);
}

TEST_P(UmeyamaTest, NoNeighbouringTransformIsBetter) {
  const Points x = Cloud(20, 1, 1, 1);
  Points y = Moved(AnyPose(), x);
  std::vector<double> w;
  for (Eigen::Vector3d& p : y) {
    p += Gaussian(0.3, 0.3, 0.3);
    w.push_back(std::abs(normal_(random_)));
  }
  const Pose T = FitRigidTransform(x, y, w).T_y_x;
  const double best = Cost(T, x, y, w);
  for (int i = 0; i < 500; ++i) {
    Vector6d step;
    for (int k = 0; k < 6; ++k) step[k] = normal_(random_);
    step *= std::pow(10.0, -0.01 * i);
    EXPECT_GE(Cost(Retract(T, step), x, y, w), best - 1e-9);
  }
}

TEST_P(UmeyamaTest, ZeroWeightLeavesAPointOut) {
  const Points x = Cloud(10, 1, 1, 1);
  const Pose truth = AnyPose();
  Points y = Moved(truth, x);
  std::vector<double> w(10, 2.0);
  y[3] += Eigen::Vector3d(50, 0, 0);
  w[3] = 0.0;
  EXPECT_TRUE(FitRigidTransform(x, y, w).T_y_x.isApprox(truth, 1e-9));
}

TEST_P(UmeyamaTest, MirroredPointsGiveARotation) {
  const Points x = Cloud(30, 3, 2, 0.5);
  Points y;
  for (const Eigen::Vector3d& p : x) y.emplace_back(p.x(), p.y(), -p.z());
  const Pose T = FitRigidTransform(x, y).T_y_x;
  EXPECT_NEAR(T.linear().determinant(), 1.0, 1e-9);
  EXPECT_TRUE((T.linear() * T.linear().transpose()).isIdentity(1e-9));
}

TEST_P(UmeyamaTest, PlanarPointsAreDetermined) {
  const Points x = Cloud(30, 3, 2, 0);
  const Pose truth = AnyPose();
  const UmeyamaResult fit = FitRigidTransform(x, Moved(truth, x));
  EXPECT_EQ(fit.spread, PointSpread::kPlane);
  EXPECT_TRUE(fit.T_y_x.isApprox(truth, 1e-8));
}

TEST_P(UmeyamaTest, CollinearPointsReportTheTurnAboutTheirLine) {
  const Points x = Cloud(30, 3, 0, 0);
  const Points y = Moved(AnyPose(), x);
  const UmeyamaResult fit = FitRigidTransform(x, y);
  EXPECT_EQ(fit.spread, PointSpread::kLine);
  EXPECT_NEAR(fit.rms_m, 0.0, 1e-7);
  EXPECT_NEAR(fit.T_y_x.linear().determinant(), 1.0, 1e-9);
  ASSERT_EQ(fit.degenerate_directions.size(), 1U);
  // Following the direction leaves the error as it is.
  const Pose turned = Retract(fit.T_y_x, 1e-4 * fit.degenerate_directions[0]);
  EXPECT_NEAR(Cost(turned, x, y, std::vector<double>(30, 1.0)), 0.0, 1e-12);
}

TEST_P(UmeyamaTest, OnePointOnlyShifts) {
  const Points x(5, Gaussian(5, 5, 5));
  const Points y(5, Gaussian(5, 5, 5));
  const UmeyamaResult fit = FitRigidTransform(x, y);
  EXPECT_EQ(fit.spread, PointSpread::kPoint);
  EXPECT_EQ(fit.degenerate_directions.size(), 3U);
  EXPECT_TRUE(fit.T_y_x.linear().isIdentity());
  EXPECT_TRUE((fit.T_y_x * x[0]).isApprox(y[0]));
}

INSTANTIATE_TEST_SUITE_P(Seeds, UmeyamaTest, ::testing::Range<std::uint64_t>(1, 6));

TEST(UmeyamaEdgeTest, NothingDeterminesNothing) {
  const UmeyamaResult fit = FitRigidTransform({}, {});
  EXPECT_EQ(fit.spread, PointSpread::kNothing);
  EXPECT_EQ(fit.degenerate_directions.size(), 6U);
  EXPECT_TRUE(fit.T_y_x.isApprox(Pose::Identity()));
}

TEST(PointInformationTest, EqualsNumericSecondDerivative) {
  const Points x = {{1, 2, 3}, {-4, 0.5, 2}, {0, -1, 7}};
  const double sigma = 0.2;
  const auto cost = [&](const Vector6d& step) {
    return Cost(Retract(Pose::Identity(), step), x, x, {1, 1, 1}) / (2 * sigma * sigma);
  };
  const Matrix6d information = PointInformation(x, sigma);
  const double h = 1e-4;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      const Vector6d a = h * Vector6d::Unit(i);
      const Vector6d b = h * Vector6d::Unit(j);
      const double numeric = (cost(a + b) - cost(a - b) - cost(b - a) + cost(-a - b)) / (4 * h * h);
      EXPECT_NEAR(information(i, j), numeric, 1e-3 * information.norm()) << i << ' ' << j;
    }
  }
}

}  // namespace
}  // namespace strata
