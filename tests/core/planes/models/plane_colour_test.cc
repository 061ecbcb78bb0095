#include "core/planes/models/plane_colour.h"

#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/planes/models/coloured_cells.h"
#include "core/planes/models/plane_model_finder.h"
#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

using testing::Random;

// CIELAB of sRGB under D65 as published (B. Lindbloom, CIE colour calculator).
TEST(PlaneColour, IsCielabWithAThirdOfItsLightness) {
  struct Known {
    Colour colour;
    double l, a, b;
  };
  for (const Known& known : {Known{{255, 0, 0}, 53.2408, 80.0925, 67.2032},
                             Known{{0, 255, 0}, 87.7347, -86.1827, 83.1793},
                             Known{{0, 0, 255}, 32.2970, 79.1875, -107.8602},
                             Known{{255, 255, 0}, 97.1393, -21.5537, 94.4780},
                             Known{{255, 255, 255}, 100.0, 0.0, 0.0},
                             Known{{0, 0, 0}, 0.0, 0.0, 0.0}}) {
    const LabColour lab = LabOf(known.colour);
    EXPECT_NEAR(lab.x() / 0.3, known.l, 0.01);
    EXPECT_NEAR(lab.y(), known.a, 0.01);
    EXPECT_NEAR(lab.z(), known.b, 0.01);
  }
}

TEST(PlaneColour, ComesBackFromItsMean) {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const std::uint64_t bits = random.Bits();
    const Colour colour{static_cast<std::uint8_t>(bits),
                        static_cast<std::uint8_t>(bits >> 8),
                        static_cast<std::uint8_t>(bits >> 16)};
    EXPECT_EQ(ColourOf(LabOf(colour)), colour) << PackedRgb(colour);
  }
  EXPECT_EQ(ColourOf({60.0, 0.0, 0.0}), (Colour{255, 255, 255}));
}

// Shells of the density around its mean, by their volumes: a vector's, not that of two scalars.
TEST(PlaneColour, DensityOfAVectorIntegratesToOne) {
  double sum = 0.0;
  const double step = 0.05;
  for (double r = 0.5 * step; r < 20'000.0; r += step) {
    sum += 4.0 * M_PI * r * r * std::exp(ColourLog(r * r)) * step;
  }
  EXPECT_NEAR(sum, 1.0, 1e-3);
}

// The bound of EM: with weights of one distance, Σ of weighted squares is above at all others.
TEST(PlaneColour, WeightsBoundTheDensity) {
  for (const double at : {0.0, 30.0, 400.0, 9000.0}) {
    const double step = 1e-4 * (at + 1.0);
    const double slope = (ColourLog(at + step) - ColourLog(at - step * (at > 0.0 ? 1.0 : 0.0))) /
                         (at > 0.0 ? 2.0 * step : step);
    // σ₂² of the weighted squares.
    const double variance = -ColourWeight(at) / (2.0 * slope);
    EXPECT_NEAR(variance, 64.0, 0.05);
    for (const double other : {0.0, 10.0, 100.0, 1000.0, 20'000.0}) {
      EXPECT_GE(ColourLog(other),
                ColourLog(at) - ColourWeight(at) * (other - at) / (2.0 * 64.0) - 1e-9);
    }
  }
}

TEST(PlaneColour, DensityOfAnyColourIsThatOfTheScreensVolume) {
  // Volume of sRGB in CIELAB by counting cubes of 4 that random screen colours fall into: each of
  // the gamut's is hit about forty times.
  Random random(2);
  std::vector<bool> hit(64 * 64 * 64, false);
  for (int i = 0; i < 500'000; ++i) {
    const std::uint64_t bits = random.Bits();
    const LabColour lab = LabOf({static_cast<std::uint8_t>(bits),
                                 static_cast<std::uint8_t>(bits >> 8),
                                 static_cast<std::uint8_t>(bits >> 16)});
    const auto x = static_cast<std::size_t>(lab.x() / 0.3 / 4.0);
    const auto y = static_cast<std::size_t>((lab.y() + 128.0) / 4.0);
    const auto z = static_cast<std::size_t>((lab.z() + 128.0) / 4.0);
    hit[(x * 64 + y) * 64 + z] = true;
  }
  double cubes = 0.0;
  for (const bool one : hit) cubes += one ? 1.0 : 0.0;
  // Cubes on the border count whole.
  EXPECT_GT(cubes * 64.0, 821'515.0);
  EXPECT_LT(cubes * 64.0, 1.25 * 821'515.0);
  EXPECT_NEAR(AnyColourLog(), -std::log(0.3 * 821'515.0), 1e-9);
}

void AddPoint(PosedPoints& points, const Eigen::Vector3f& p, const Colour& colour) {
  points.points.push_back(p);
  points.colour.push_back(colour);
}

PlaneExtractionOptions Cells() {
  PlaneExtractionOptions options;
  options.sensor.sigma_m = 0.02;
  options.sensor.sigma_per_metre = 0.0;
  options.cell_size_m = 0.8;
  options.max_rms_m = 0.06;
  options.max_range_m = 1000.0;
  return options;
}

// A strip of another colour through the middle of one cell.
TEST(ColouredCells, APlaceOfTwoColoursHasCellsOfEach) {
  Random random(3);
  PosedPoints points;
  for (int i = 0; i < 2000; ++i) {
    const auto x = static_cast<float>(random.Uniform(0.01, 0.79));
    const auto y = static_cast<float>(random.Uniform(0.01, 0.79));
    const bool strip = x > 0.3F && x < 0.5F;
    AddPoint(points, {x, y, 0.4F}, strip ? Colour{170, 40, 40} : Colour{150, 150, 150});
  }
  points.views = {{{0, 0, 2}, points.points.size()}};
  const std::vector<CellLayer> layers = FindColouredCells(points, Cells());
  ASSERT_EQ(layers.size(), 2U);
  double areas[2] = {0.0, 0.0};
  std::uint32_t counts[2] = {0, 0};
  for (std::size_t k = 0; k < 2; ++k) {
    ASSERT_EQ(layers[k].cells.size(), layers[k].colours.size());
    for (std::size_t i = 0; i < layers[k].cells.size(); ++i) {
      areas[k] += layers[k].cells[i].area_m2;
      counts[k] += layers[k].cells[i].point_count;
      EXPECT_LT(layers[k].colours[i].variance, 1e-6);
    }
  }
  EXPECT_LT((layers[1].colours[0].mean - LabOf({170, 40, 40})).norm(), 1e-3);
  EXPECT_EQ(counts[0] + counts[1], 2000U);
  EXPECT_NEAR(areas[1], 0.2 * 0.78, 0.03);
}

TEST(ColouredCells, NoiseAndAGradientAreOneColour) {
  Random random(4);
  PosedPoints points;
  for (int i = 0; i < 3000; ++i) {
    const auto x = static_cast<float>(random.Uniform(0.01, 0.79));
    const auto y = static_cast<float>(random.Uniform(0.01, 0.79));
    const double red = 100.0 + 60.0 * x + 8.0 * random.Gaussian();
    const double green = 100.0 + 8.0 * random.Gaussian();
    AddPoint(points,
             {x, y, 0.4F},
             {static_cast<std::uint8_t>(red), static_cast<std::uint8_t>(green), 100});
  }
  points.views = {{{0, 0, 2}, points.points.size()}};
  const std::vector<CellLayer> layers = FindColouredCells(points, Cells());
  ASSERT_EQ(layers.size(), 1U);
  EXPECT_EQ(layers[0].cells.size(), 1U);
}

// One point in fifty shows a door across the corridor: such a layer is thin, whatever its extent.
TEST(ColouredCells, ScatteredReflectionsAreLittleSurface) {
  Random random(5);
  PosedPoints points;
  for (int i = 0; i < 3000; ++i) {
    const auto x = static_cast<float>(random.Uniform(0.01, 0.79));
    const auto y = static_cast<float>(random.Uniform(0.01, 0.79));
    AddPoint(points, {x, y, 0.4F}, i % 50 == 0 ? Colour{220, 180, 40} : Colour{200, 200, 200});
  }
  points.views = {{{0, 0, 2}, points.points.size()}};
  const std::vector<CellLayer> layers = FindColouredCells(points, Cells());
  ASSERT_EQ(layers.size(), 2U);
  double area = 0.0;
  for (const PlanarCell& cell : layers[1].cells) {
    area += cell.area_m2;
    EXPECT_NEAR(cell.moments(3, 3), cell.area_m2, 1e-12);
  }
  EXPECT_LT(area, 0.05);
  EXPECT_GT(layers[0].cells[0].area_m2, 0.55);
}

}  // namespace
}  // namespace strata
