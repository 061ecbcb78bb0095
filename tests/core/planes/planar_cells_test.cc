#include "core/planes/planar_cells.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "core/planes/extraction.h"
#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

using testing::Random;

// Two strips of 0.04 x 0.8 m, at 45° to the plane that goes through both.
std::vector<Eigen::Vector3f> TwoStrips() {
  Random random(9);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 600; ++i) {
    const double x = random.Uniform(0.0, 0.8), along = random.Uniform(0.0, 0.028);
    const double noise = 0.003 * random.Gaussian();
    const double z = i % 2 == 0 ? 0.15 : 0.65;
    points.push_back(Eigen::Vector3d(x, 0.4 + along + noise, z + along - noise).cast<float>());
  }
  return points;
}

PlaneExtractionOptions CellOptions() {
  PlaneExtractionOptions options;
  options.cell_size_m = 0.8;
  options.sensor.sigma_m = 0.02;
  options.sensor.sigma_per_metre = 0.0;
  return options;
}

double AreaUpright(const std::vector<PlanarCell>& cells) {
  double area_m2 = 0.0;
  for (const PlanarCell& cell : cells) {
    if (std::abs(cell.normal.y()) > 0.95) area_m2 += cell.area_m2;
  }
  return area_m2;
}

TEST(FindPlanarCells, AnEvenCellIsNoPlaneThroughStrips) {
  PlaneExtractionOptions options = CellOptions();
  options.sensor.sigma_m = 0.005;
  const std::vector<Eigen::Vector3f> points = TwoStrips();
  const Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  EXPECT_GT(AreaUpright(FindPlanarCells(points, origin, options)), 0.3);
  EXPECT_LT(AreaUpright(FindPlanarCells(points, origin, options, CellCheck::kEven)), 0.1);
}

// Few points of one face, seen from one side, more of the other: together as flat as a rough wall.
TEST(FindPlanarCells, NoCellHoldsBothFacesOfAThinWall) {
  Random random(11);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 40; ++i) {
    const double x = random.Uniform(0.0, 0.8), z = random.Uniform(0.0, 0.8);
    const double y = (i < 30 ? 0.48 : 0.56) + 0.005 * random.Gaussian();
    points.push_back(Eigen::Vector3d(x, y, z).cast<float>());
  }
  const Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  const PlaneExtractionOptions options = CellOptions();
  const auto rough = FindPlanarCells(points, origin, options, CellCheck::kEven);
  ASSERT_EQ(rough.size(), 1U);
  EXPECT_GT(rough[0].rms_m, 0.03);
  const auto sensor_of = [](std::uint32_t i) {
    return Eigen::Vector3f(0.4F, i < 30 ? -2.0F : 3.0F, 0.4F);
  };
  for (const PlanarCell& cell :
       FindPlanarCells(points, origin, options, CellCheck::kEven, sensor_of)) {
    EXPECT_LT(cell.rms_m, 0.02);
  }
}

// A wall of 0.8 x 0.8 m is even, sparse or dense.
TEST(FindPlanarCells, ASurfaceIsEven) {
  for (const int count : {12, 40, 4000}) {
    SCOPED_TRACE(count);
    Random random(10);
    std::vector<Eigen::Vector3f> points;
    for (int i = 0; i < count; ++i) {
      const double x = random.Uniform(0.0, 0.8), z = random.Uniform(0.0, 0.8);
      points.push_back(Eigen::Vector3d(x, 0.4 + 0.01 * random.Gaussian(), z).cast<float>());
    }
    const std::vector<PlanarCell> cells =
        FindPlanarCells(points, Eigen::Vector3f::Zero(), CellOptions(), CellCheck::kEven);
    ASSERT_EQ(cells.size(), 1U);
    EXPECT_GT(std::abs(cells[0].normal.y()), 0.99);
  }
}

}  // namespace
}  // namespace strata
