#include "core/mls/local_plane.h"

#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include <Eigen/Dense>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata {
namespace {

constexpr double kCell = 0.2;

struct Placed {
  int dx, dy;
  double z;
  HeightSample sample;
};

std::optional<LocalPlane> Fit(const std::vector<Placed>& placed) {
  LocalPlaneFit fit(kCell);
  for (const Placed& p : placed) fit.Add(p.dx, p.dy, p.z, p.sample);
  return fit.Solve();
}

std::vector<Placed> Grid(int radius, double sigma_m) {
  std::vector<Placed> grid;
  for (int dy = -radius; dy <= radius; ++dy) {
    for (int dx = -radius; dx <= radius; ++dx) {
      const Surface surface = {.sigma_m = static_cast<float>(sigma_m)};
      grid.push_back({dx, dy, 0.0, SampleOf(surface, kCell)});
    }
  }
  return grid;
}

TEST(LocalPlaneTest, IsTheWeightedLeastSquaresSolution) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<Placed> placed;
    for (Placed p : Grid(2, 0.0)) {
      if (uniform(random) < 0.4) continue;
      p.z = 0.3 * uniform(random);
      p.sample = SampleOf({.sigma_m = static_cast<float>(0.1 * uniform(random))}, kCell);
      placed.push_back(p);
    }
    const std::optional<LocalPlane> plane = Fit(placed);
    ASSERT_TRUE(plane.has_value());
    // By a QR decomposition of the weighted rows.
    Eigen::MatrixXd A(placed.size(), 3);
    Eigen::VectorXd b(placed.size());
    double weights = 0.0;
    for (std::size_t i = 0; i < placed.size(); ++i) {
      const double w = std::sqrt(double{placed[i].sample.weight});
      A.row(i) << w * placed[i].dx * kCell, w * placed[i].dy * kCell, w;
      b(i) = w * placed[i].z;
      weights += placed[i].sample.weight;
    }
    const Eigen::Vector3d x = A.colPivHouseholderQr().solve(b);
    EXPECT_NEAR(plane->gradient.x(), x(0), 1e-9);
    EXPECT_NEAR(plane->gradient.y(), x(1), 1e-9);
    EXPECT_NEAR(plane->height_m, x(2), 1e-9);
    const double n = static_cast<double>(placed.size());
    EXPECT_NEAR(
        plane->residual_m, std::sqrt((A * x - b).squaredNorm() / weights * n / (n - 3.0)), 1e-9);
  }
}

TEST(LocalPlaneTest, GradientSigmaAndNoiseAreTheSpreadOfManyNoisyFits) {
  std::mt19937 random(2);
  const double sigma = 0.03;
  std::normal_distribution<double> noise(0.0, sigma);
  std::vector<Placed> grid = Grid(2, sigma);
  double squared_gradient = 0.0;
  double said_gradient = 0.0;
  double squared_residual = 0.0;
  double said_noise = 0.0;
  int rough = 0;
  const int trials = 4000;
  for (int i = 0; i < trials; ++i) {
    for (Placed& p : grid) p.z = 0.5 * p.dx * kCell + noise(random);
    const LocalPlane plane = Fit(grid).value();
    squared_gradient += std::pow(plane.gradient.x() - 0.5, 2) / trials;
    said_gradient += std::pow(plane.gradient_sigma, 2) / trials;
    squared_residual += std::pow(plane.residual_m, 2) / trials;
    said_noise += std::pow(plane.noise_m, 2) / trials;
    rough += plane.roughness_m() > 0.0;
  }
  EXPECT_NEAR(said_gradient / squared_gradient, 1.0, 0.1);
  EXPECT_NEAR(squared_residual, sigma * sigma, 0.05 * sigma * sigma);
  EXPECT_NEAR(said_noise, sigma * sigma + std::pow(0.5 * kCell, 2) / 12.0, 2e-5);
  EXPECT_LE(rough, 0.005 * trials);
}

TEST(LocalPlaneTest, RoughnessIsWhatSigmaLeavesUnexplained) {
  std::mt19937 random(3);
  std::normal_distribution<double> rubble(0.0, 0.1);
  std::vector<Placed> grid = Grid(2, 0.001);
  double squared = 0.0;
  for (int i = 0; i < 2000; ++i) {
    for (Placed& p : grid) p.z = rubble(random);
    squared += std::pow(Fit(grid)->roughness_m(), 2) / 2000;
  }
  EXPECT_NEAR(std::sqrt(squared), 0.1, 0.003);
}

TEST(LocalPlaneTest, TooFewOrCollinearSamplesGiveNone) {
  const HeightSample sample = SampleOf({.sigma_m = 0.01F}, kCell);
  EXPECT_FALSE(Fit({}).has_value());
  EXPECT_FALSE(Fit({{0, 0, 0, sample}, {1, 0, 0, sample}, {0, 1, 0, sample}}).has_value());
  std::vector<Placed> row;
  for (int dx = -2; dx <= 2; ++dx) row.push_back({dx, 0, 0.1 * dx, sample});
  EXPECT_FALSE(Fit(row).has_value());
  std::vector<Placed> diagonal;
  for (int d = -2; d <= 2; ++d) diagonal.push_back({d, d, 0.0, sample});
  EXPECT_FALSE(Fit(diagonal).has_value());
  for (int dx = -2; dx <= 2; ++dx) row.push_back({dx, 1, 0.1 * dx, sample});
  ASSERT_TRUE(Fit(row).has_value());
  EXPECT_NEAR(Fit(row)->gradient.x(), 0.1 / kCell, 1e-9);
  EXPECT_NEAR(Fit(row)->gradient.y(), 0.0, 1e-9);
}

}  // namespace
}  // namespace strata
