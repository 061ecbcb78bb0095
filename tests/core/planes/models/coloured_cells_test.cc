#include "core/planes/models/coloured_cells.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "core/planes/extraction.h"
#include "core/planes/planar_cells.h"
#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

using testing::Random;

// Of a surface of 8 x 8 m that rises by `slope` along x, through `height_m` at x = 4: what its
// cells say of its area, before and after borders are shared.
struct Areas {
  double before_m2 = 0.0, after_m2 = 0.0;
};

Areas AreasOf(double height_m, double slope, std::uint64_t seed) {
  Random random(seed);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < 40000; ++i) {
    const double x = random.Uniform(0.0, 8.0), y = random.Uniform(0.0, 8.0);
    const double z = height_m + slope * (x - 4.0) + 0.01 * random.Gaussian();
    points.push_back(Eigen::Vector3d(x, y, z).cast<float>());
  }
  PlaneExtractionOptions options;
  options.cell_size_m = 0.8;
  options.sensor.sigma_m = 0.02;
  options.sensor.sigma_per_metre = 0.0;
  std::vector<CellLayer> layers(1);
  layers[0].cells = FindPlanarCells(points, Eigen::Vector3f::Zero(), options);
  layers[0].colours.resize(layers[0].cells.size());
  Areas areas;
  for (const PlanarCell& cell : layers[0].cells) areas.before_m2 += cell.area_m2;
  ShareBorders(layers);
  for (const PlanarCell& cell : layers[0].cells) {
    areas.after_m2 += cell.area_m2;
    EXPECT_NEAR(cell.moments(3, 3), cell.area_m2, 1e-9);
  }
  return areas;
}

// At 1.6 m a layer of cells of 0.8 m ends.
TEST(ShareBorders, CountsASurfaceOnTheBorderOfTwoLayersOnce) {
  const Areas areas = AreasOf(1.6, 0.0, 5);
  EXPECT_GT(areas.before_m2, 115.0);
  EXPECT_NEAR(areas.after_m2, 64.0, 3.0);
  const Areas more_below = AreasOf(1.595, 0.0, 6);
  EXPECT_NEAR(more_below.after_m2, 64.0, 3.0);
}

TEST(ShareBorders, LeavesOthersAlone) {
  const Areas within = AreasOf(1.2, 0.0, 7);
  EXPECT_DOUBLE_EQ(within.before_m2, within.after_m2);
  EXPECT_NEAR(within.after_m2, 64.0, 3.0);
  for (const double slope : {0.02, 0.05, 0.2}) {
    SCOPED_TRACE(slope);
    const double area_m2 = 64.0 * std::hypot(1.0, slope);
    EXPECT_NEAR(AreasOf(1.6, slope, 8).after_m2, area_m2, 0.06 * area_m2);
  }
}

// One layer is of the floor below the border, the other of a carpet above it.
TEST(ShareBorders, OfTwoColoursThereAreTwoSurfaces) {
  Random random(11);
  std::vector<Eigen::Vector3f> below, above;
  for (int i = 0; i < 600; ++i) {
    const double x = random.Uniform(0.0, 0.8), y = random.Uniform(0.0, 0.8);
    const double off = 0.004 * random.Uniform(0.0, 1.0);
    below.push_back(Eigen::Vector3d(x, y, 0.8 - off).cast<float>());
    above.push_back(Eigen::Vector3d(x, y, 0.8 + off).cast<float>());
  }
  PlaneExtractionOptions options;
  options.cell_size_m = 0.8;
  for (const double apart : {0.0, 60.0}) {
    SCOPED_TRACE(apart);
    std::vector<CellLayer> layers(2);
    layers[0].cells = FindPlanarCells(below, Eigen::Vector3f::Zero(), options);
    layers[1].cells = FindPlanarCells(above, Eigen::Vector3f::Zero(), options);
    ASSERT_EQ(layers[0].cells.size(), 1U);
    ASSERT_EQ(layers[1].cells.size(), 1U);
    layers[0].colours.resize(1);
    layers[1].colours.push_back({LabColour(0.0, apart, 0.0), 0.0});
    ShareBorders(layers);
    const double area_m2 = layers[0].cells[0].area_m2 + layers[1].cells[0].area_m2;
    EXPECT_NEAR(area_m2, apart > 0.0 ? 1.28 : 0.64, 0.05);
  }
}

}  // namespace
}  // namespace strata
