#include "core/planes/curvature.h"

#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "core/common/random.h"
#include "core/planes/planar_cells.h"

namespace strata {
namespace {

constexpr std::uint64_t kSeed = 20261126;

// Points of z = ½ (k_x x² + k_y y²) over 8 × 8 m below a sensor, with noise along z.
std::vector<Eigen::Vector3f> Bowl(double k_x, double k_y, double sigma_m) {
  SplitMix64 random(kSeed);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 20000; ++i) {
    const double x = 8.0 * random.Uniform() - 4.0;
    const double y = 8.0 * random.Uniform() - 4.0;
    double noise = -6.0;
    for (int k = 0; k < 12; ++k) noise += random.Uniform();
    const double z = 0.5 * (k_x * x * x + k_y * y * y) + sigma_m * noise - 1.5;
    points.push_back(Eigen::Vector3d(x, y, z).cast<float>());
  }
  return points;
}

// The larger principal curvature.
double LargerOf(const Eigen::Vector3d& k) {
  Eigen::Matrix2d K;
  K << k(0), k(1), k(1), k(2);
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(K).eigenvalues().cwiseAbs().maxCoeff();
}

double CurvatureOfAll(const std::vector<Eigen::Vector3f>& points) {
  const std::vector<PlanarCell> cells = FindPlanarCells(points, Eigen::Vector3f::Zero(), {});
  std::vector<std::uint32_t> all(cells.size());
  std::iota(all.begin(), all.end(), 0U);
  const Eigen::Vector3d axis_u = Eigen::Vector3d(1.0, 2.0, 0.0).normalized();
  return LargerOf(CurvatureOf(cells, all, axis_u, Eigen::Vector3d::UnitZ().cross(axis_u)));
}

TEST(CurvatureTest, IsThatOfTheSurface) {
  EXPECT_NEAR(CurvatureOfAll(Bowl(0.012, 0.0, 0.01)), 0.012, 0.001);
  EXPECT_NEAR(CurvatureOfAll(Bowl(0.004, -0.02, 0.01)), 0.02, 0.002);
  EXPECT_LT(CurvatureOfAll(Bowl(0.0, 0.0, 0.02)), 0.002);
}

TEST(CurvatureTest, FewCellsSayNothing) {
  const std::vector<PlanarCell> cells =
      FindPlanarCells(Bowl(0.02, 0.02, 0.005), Eigen::Vector3f::Zero(), {});
  const std::vector<std::uint32_t> three = {0, 1, 2};
  const auto of = [&](std::span<const std::uint32_t> members) {
    return CurvatureOf(cells, members, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY());
  };
  EXPECT_TRUE(of(three).isZero(0.0));
  EXPECT_TRUE(of({}).isZero(0.0));
}

}  // namespace
}  // namespace strata
