#include "core/mls/traversability.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "tests/core/mls/surface_world.h"

namespace strata {
namespace {

using testing::Draw;
using testing::Drawing;
using testing::Level;
using testing::NeighboursOf;
using testing::SurfaceAt;
using testing::SurfaceWorld;

constexpr double kCell = 0.1;
constexpr Traversability kYes = Traversability::kTraversable;
constexpr Traversability kNo = Traversability::kNonTraversable;

// A drawing of 40 × 40 cells around cell (128, 128), annotated.
SurfaceWorld Annotated(const Drawing& drawing,
                       const TraversabilityLimits& limits = {},
                       double cell_size_m = kCell) {
  SurfaceWorld world = Draw(drawing, 108, 148, 108, 148);
  for (auto& [key, tile] : world) {
    AnnotateTraversability(tile, NeighboursOf(world, key), cell_size_m, limits);
  }
  return world;
}

double X(CellIndex cell) { return (cell.x - 128 + 0.5) * kCell; }
double Y(CellIndex cell) { return (cell.y - 128 + 0.5) * kCell; }

constexpr int kInterior = 36 * 36;

// Of the surfaces whose whole window is drawn.
int CountTraversable(const SurfaceWorld& world) {
  int count = 0;
  for (int y = 110; y < 146; ++y) {
    for (int x = 110; x < 146; ++x) count += SurfaceAt(world, {x, y}).traversability == kYes;
  }
  return count;
}

TEST(TraversabilityTest, FlatFloorIsTraversableToItsEdgeAndCostsNothing) {
  const SurfaceWorld world = Annotated([](CellIndex) { return std::vector<Level>{{.z_m = 3.0}}; });
  for (const Surface& surface : world.begin()->second.surfaces) {
    EXPECT_EQ(surface.traversability, kYes);
    EXPECT_GE(surface.cost, 0.0F);
    EXPECT_LT(surface.cost, 0.01F);
  }
}

// A ramp of slope `angle` in the direction `heading`.
Drawing Ramp(double angle_rad, double heading_rad) {
  return [=](CellIndex cell) {
    const double along = X(cell) * std::cos(heading_rad) + Y(cell) * std::sin(heading_rad);
    return std::vector<Level>{{.z_m = std::tan(angle_rad) * along}};
  };
}

TEST(TraversabilityTest, RampIsTraversableUpToTheSlopeLimitInEveryDirection) {
  for (const double heading : {0.0, 0.4, 0.785, 1.3, 2.5, 4.0}) {
    SCOPED_TRACE(heading);
    EXPECT_EQ(CountTraversable(Annotated(Ramp(0.33, heading))), kInterior);
    EXPECT_EQ(CountTraversable(Annotated(Ramp(0.38, heading))), 0);
    EXPECT_EQ(CountTraversable(Annotated(Ramp(0.8, heading))), 0);
  }
}

TEST(TraversabilityTest, CoarseCellsMayDifferByTheSlopeOverTheirDistance) {
  const auto ramp = [](double tangent) {
    return [=](CellIndex cell) { return std::vector<Level>{{.z_m = tangent * 3.0 * cell.x}}; };
  };
  EXPECT_EQ(CountTraversable(Annotated(ramp(0.3), {}, 3.0)), kInterior);
  EXPECT_EQ(CountTraversable(Annotated(ramp(0.5), {}, 3.0)), 0);
}

// Flat ground with a step of `height` up at x = 0.
Drawing Step(double height_m, double sigma_m = 0.002) {
  return [=](CellIndex cell) {
    return std::vector<Level>{{.z_m = X(cell) < 0.0 ? 0.0 : height_m, .sigma_m = sigma_m}};
  };
}

// Rough ground, the same on every storey; heights are such that floats hold them exactly.
Drawing Storeys(int storeys) {
  return [=](CellIndex cell) {
    constexpr double kStoreyM = 4.0;
    const unsigned noise = (static_cast<unsigned>(cell.x) * 2654435761U ^
                            static_cast<unsigned>(cell.y) * 2246822519U) >>
                           16U;
    std::vector<Level> levels;
    for (int storey = 0; storey < storeys; ++storey) {
      if (noise % 11 == 0) continue;  // nothing was seen here
      levels.push_back({.z_m = kStoreyM * storey + (noise % 16) / 64.0});
    }
    return levels;
  };
}

TEST(TraversabilityTest, AStoreyOfManyIsWhatItIsOfThree) {
  constexpr int kMany = 60;
  const SurfaceWorld few = Annotated(Storeys(3));
  const SurfaceWorld many = Annotated(Storeys(kMany));
  int compared = 0;
  for (int y = 108; y < 148; ++y) {
    for (int x = 108; x < 148; ++x) {
      const std::uint16_t cell = CellInTile({x, y});
      const auto three = few.begin()->second.Cell(cell);
      const auto all = many.begin()->second.Cell(cell);
      if (three.empty()) continue;
      ASSERT_EQ(all.size(), static_cast<std::size_t>(kMany));
      for (std::size_t storey = 1; storey + 1 < all.size(); ++storey) {
        EXPECT_EQ(all[storey].traversability, three[1].traversability) << x << ", " << y;
        EXPECT_EQ(all[storey].cost, three[1].cost) << x << ", " << y;
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 1000 * kMany);
}

TEST(TraversabilityTest, StepBelowTheLimitIsPassedEverywhere) {
  const SurfaceWorld world = Annotated(Step(0.14));
  EXPECT_EQ(CountTraversable(world), kInterior);
  // It costs more than flat ground.
  EXPECT_GT(SurfaceAt(world, {128, 128}).cost, SurfaceAt(world, {140, 128}).cost + 0.5F);
}

TEST(TraversabilityTest, StepAboveTheLimitBlocksBothSidesOfItOnly) {
  const SurfaceWorld world = Annotated(Step(0.17));
  for (int y = 108; y < 148; ++y) {
    for (int x = 108; x < 148; ++x) {
      const bool beside = x == 127 || x == 128;
      EXPECT_EQ(SurfaceAt(world, {x, y}).traversability, beside ? kNo : kYes) << x << ", " << y;
    }
  }
}

TEST(TraversabilityTest, StepCountsOnlyBeyondWhatSigmaExplains) {
  // √2 · 0.02 m · 3 = 0.085 m are put down to noise.
  EXPECT_EQ(SurfaceAt(Annotated(Step(0.22, 0.02)), {128, 128}).traversability, kYes);
  EXPECT_EQ(SurfaceAt(Annotated(Step(0.25, 0.02)), {128, 128}).traversability, kNo);
}

TEST(TraversabilityTest, KerbAroundACornerIsPassedAndAWallIsNot) {
  const auto block = [](double height_m) {
    return [=](CellIndex cell) {
      const bool inside = X(cell) > 0.0 && Y(cell) > 0.0;
      // Seen from the side: the edge is a vertical patch.
      const bool edge = inside && (X(cell) < kCell || Y(cell) < kCell);
      return std::vector<Level>{{.z_m = inside ? height_m : 0.0, .depth_m = edge ? height_m : 0.0}};
    };
  };
  EXPECT_EQ(CountTraversable(Annotated(block(0.12))), kInterior);
  const SurfaceWorld wall = Annotated(block(0.5));
  EXPECT_EQ(SurfaceAt(wall, {127, 135}).traversability, kNo);
  EXPECT_EQ(SurfaceAt(wall, {128, 135}).traversability, kNo);
  EXPECT_EQ(SurfaceAt(wall, {127, 127}).traversability, kNo);  // touches the corner
  EXPECT_EQ(SurfaceAt(wall, {126, 126}).traversability, kYes);
  EXPECT_EQ(SurfaceAt(wall, {130, 130}).traversability, kYes);
}

TEST(TraversabilityTest, TopOfAThinWallIsNotTraversable) {
  for (const int thickness : {1, 2}) {
    const SurfaceWorld world = Annotated([=](CellIndex cell) {
      const bool wall = cell.x >= 128 && cell.x < 128 + thickness;
      return std::vector<Level>{{.z_m = wall ? 2.0 : 0.0, .depth_m = wall ? 2.0 : 0.0}};
    });
    EXPECT_EQ(SurfaceAt(world, {128, 128}).traversability, kNo);
    EXPECT_EQ(SurfaceAt(world, {127, 128}).traversability, kNo);
    EXPECT_EQ(SurfaceAt(world, {126, 128}).traversability, kYes);
  }
}

TEST(TraversabilityTest, PoleWithoutSurroundingsIsNotTraversableAndALonePatchIsUnknown) {
  const auto lone = [](double depth_m) {
    return Annotated([=](CellIndex cell) {
      return cell.x == 128 && cell.y == 128 ? std::vector<Level>{{.z_m = 1.0, .depth_m = depth_m}}
                                            : std::vector<Level>{};
    });
  };
  EXPECT_EQ(SurfaceAt(lone(1.0), {128, 128}).traversability, kNo);
  EXPECT_EQ(SurfaceAt(lone(0.0), {128, 128}).traversability, Traversability::kUnknown);
  EXPECT_FLOAT_EQ(SurfaceAt(lone(0.0), {128, 128}).cost, 2.0F + std::pow(0.002F / 0.15F, 2.0F));
}

// Ground everywhere and a deck of `underside` to `top` over |x| < 1 m.
Drawing Deck(double underside_m, double top_m) {
  return [=](CellIndex cell) {
    std::vector<Level> levels = {{.z_m = 0.0}};
    if (std::abs(X(cell)) < 1.0) levels.push_back({.z_m = top_m, .depth_m = top_m - underside_m});
    return levels;
  };
}

TEST(TraversabilityTest, DeckOverGroundIsTraversableOnBothLevelsButForItsEdge) {
  const SurfaceWorld world = Annotated(Deck(2.0, 2.4));
  for (int x = 118; x < 138; ++x) {
    EXPECT_EQ(SurfaceAt(world, {x, 128}, 0).traversability, kYes) << x;
    const bool edge = x == 118 || x == 137;
    EXPECT_EQ(SurfaceAt(world, {x, 128}, 1).traversability, edge ? kNo : kYes) << x;
  }
  EXPECT_EQ(SurfaceAt(world, {117, 128}).traversability, kYes);
  EXPECT_NEAR(SurfaceAt(world, {128, 128}, 1).cost, SurfaceAt(world, {128, 128}, 0).cost, 1e-6);
}

// Ground everywhere, and over |x| < 1 m a deck of whose cells only every third was seen from above,
// the others from below.
Drawing SparseDeck(double underside_m, double top_m) {
  return [=](CellIndex cell) {
    std::vector<Level> levels = {{.z_m = 0.0}};
    if (std::abs(X(cell)) >= 1.0) return levels;
    if ((cell.x + cell.y) % 3 == 0) {
      levels.push_back({.z_m = top_m, .depth_m = top_m - underside_m});
    } else {
      levels.push_back({.z_m = underside_m, .underside = true});
    }
    return levels;
  };
}

TEST(TraversabilityTest, UndersidesAreNoGroundAndHideTheDropThroughTheirDeck) {
  for (const double thickness : {0.15, 0.4, 0.9}) {
    SCOPED_TRACE(thickness);
    const SurfaceWorld world = Annotated(SparseDeck(2.0, 2.0 + thickness));
    for (int y = 110; y < 146; ++y) {
      for (int x = 120; x < 136; ++x) {
        const Surface& deck = SurfaceAt(world, {x, y}, 1);
        EXPECT_EQ(SurfaceAt(world, {x, y}, 0).traversability, kYes) << x << ", " << y;
        if ((x + y) % 3 == 0) {
          EXPECT_EQ(deck.traversability, kYes) << x << ", " << y;
        } else {
          EXPECT_EQ(deck.traversability, Traversability::kUnderside);
          EXPECT_EQ(deck.cost, 0.0F);
        }
      }
    }
  }
  // Nobody takes a deck of 1.5 m for what goes on: something may lie on it, and one may fall.
  const SurfaceWorld thick = Annotated([](CellIndex cell) {
    if (cell.x < 128) return std::vector<Level>{{.z_m = 0.0}, {.z_m = 3.5, .depth_m = 1.5}};
    return std::vector<Level>{{.z_m = 0.0}, {.z_m = 2.0, .underside = true}};
  });
  EXPECT_EQ(SurfaceAt(thick, {127, 129}, 1).traversability, kNo);
  EXPECT_EQ(SurfaceAt(thick, {126, 129}, 1).traversability, kYes);
}

TEST(TraversabilityTest, CellsOfADeckThatNoBeamHitAreNoDrop) {
  const auto beside = [](int width, int length, double floor_m) {
    const SurfaceWorld world = Annotated([=](CellIndex cell) {
      std::vector<Level> levels = {{.z_m = floor_m}};
      const bool unseen = cell.x >= 128 && cell.x < 128 + width && cell.y >= 128 - length / 2 &&
                          cell.y < 128 + (length + 1) / 2;
      if (!unseen) levels.push_back({.z_m = 3.0});
      return levels;
    });
    return SurfaceAt(world, {127, 128}, 1).traversability;
  };
  for (const int width : {1, 2}) EXPECT_EQ(beside(width, 99, 0.0), kYes) << width;  // rings
  EXPECT_EQ(beside(9, 2, 0.0), kYes);
  EXPECT_EQ(beside(3, 3, 0.0), kNo);
  EXPECT_EQ(beside(2, 99, 2.6), kYes);  // the underside, which nobody knew to be one
  EXPECT_EQ(beside(1, 1, 2.8), kNo);    // a ditch
}

TEST(TraversabilityTest, ALowUndersideBlocksTheGroundBelowAndBesideIt) {
  const Drawing ceiling = [](CellIndex cell) {
    std::vector<Level> levels = {{.z_m = 0.0}};
    if (std::abs(X(cell)) < 1.0) levels.push_back({.z_m = 1.2, .underside = true});
    return levels;
  };
  const SurfaceWorld low = Annotated(ceiling, {.clearance_m = 1.3});
  EXPECT_EQ(SurfaceAt(low, {128, 128}).traversability, kNo);
  EXPECT_EQ(SurfaceAt(low, {117, 128}).traversability, kYes);  // its floor goes on
  const SurfaceWorld high = Annotated(ceiling, {.clearance_m = 1.1});
  EXPECT_EQ(SurfaceAt(high, {128, 128}).traversability, kYes);
  for (const bool upper_deck : {false, true}) {  // what is high above it says nothing
    const SurfaceWorld alone = Annotated([&](CellIndex cell) {
      if (X(cell) < 1.0) return std::vector<Level>{{.z_m = 0.0}};
      std::vector<Level> levels = {{.z_m = 0.7, .underside = true}};
      if (upper_deck) levels.push_back({.z_m = 4.0});
      return levels;
    });
    EXPECT_EQ(SurfaceAt(alone, {137, 128}).traversability, kNo);
    EXPECT_EQ(SurfaceAt(alone, {136, 128}).traversability, kYes);
  }
}

TEST(TraversabilityTest, LowDeckBlocksTheGroundBelowItByClearanceOnly) {
  const SurfaceWorld world = Annotated(Deck(1.2, 1.5), {.clearance_m = 1.3});
  EXPECT_EQ(SurfaceAt(world, {128, 128}, 0).traversability, kNo);
  EXPECT_EQ(SurfaceAt(world, {128, 128}, 1).traversability, kYes);
  // Whoever stands beside the deck is in nobody's way.
  EXPECT_EQ(SurfaceAt(world, {110, 128}).traversability, kYes);
  EXPECT_EQ(SurfaceAt(Annotated(Deck(1.2, 1.5), {.clearance_m = 1.1}), {128, 128}).traversability,
            kYes);
}

TEST(TraversabilityTest, RampToeCloserThanGapToTheGroundIsDrivenOn) {
  // A thin ramp over ground; where the two are closer than γ = 1 m they are one vertical patch.
  const double tangent = 0.3;
  const SurfaceWorld world = Draw(
      [=](CellIndex cell) {
        const double ramp = tangent * (X(cell) + 3.0);
        if (ramp <= 0.0) return std::vector<Level>{{.z_m = 0.0}};
        if (ramp < 1.0) return std::vector<Level>{{.z_m = ramp, .depth_m = ramp}};
        return std::vector<Level>{{.z_m = 0.0}, {.z_m = ramp}};
      },
      80,
      180,
      108,
      148);
  SurfaceWorld annotated = world;
  for (auto& [key, tile] : annotated) {
    AnnotateTraversability(tile, NeighboursOf(world, key), kCell, {});
  }
  for (int x = 80; x < 180; ++x) {
    const auto column = annotated.begin()->second.Cell(CellInTile({x, 128}));
    EXPECT_EQ(column.back().traversability, kYes) << "the way up at x = " << x;
    if (column.size() < 2) continue;
    // Below the ramp: free, but for the first cell, which faces the closed wedge.
    const bool first = annotated.begin()->second.Cell(CellInTile({x - 1, 128})).size() < 2;
    EXPECT_EQ(column.front().traversability, first ? kNo : kYes) << "below at x = " << x;
  }
}

TEST(TraversabilityTest, NoisyFlatGroundIsTraversableAndRoughGroundIsNot) {
  for (const double sigma : {0.01, 0.03, 0.06, 0.1}) {
    SCOPED_TRACE(::testing::Message() << "sigma " << sigma << ", seed 7");
    std::mt19937 random(7);
    std::normal_distribution<double> noise(0.0, sigma);
    std::vector<double> heights(300 * 300);
    for (double& z : heights) z = noise(random);
    const auto drawn = [&](double said_sigma) {
      return Annotated([&heights, said_sigma](CellIndex cell) {
        return std::vector<Level>{{.z_m = heights[cell.y * 300 + cell.x], .sigma_m = said_sigma}};
      });
    };
    // The heights are as uncertain as they say: it may be flat.
    EXPECT_GE(CountTraversable(drawn(sigma)), 0.995 * kInterior);
    // The same heights, known to 2 mm: rubble. Its steps and roughness count.
    if (sigma >= 0.1) {
      EXPECT_LE(CountTraversable(drawn(0.002)), 0.1 * kInterior);
    }
  }
}

TEST(TraversabilityTest, NoiseDoesNotMakeASteepRampTraversable) {
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0.0, 0.02);
  const SurfaceWorld world = Annotated([&](CellIndex cell) {
    return std::vector<Level>{{.z_m = 0.55 * X(cell) + noise(random), .sigma_m = 0.02}};
  });
  EXPECT_LE(CountTraversable(world), 0.01 * kInterior) << "seed 11";
}

TEST(TraversabilityTest, RoughnessIsWhatNoiseDoesNotExplain) {
  // ±0.1 m from cell to cell: steps of 0.2 m pass for this robot, the roughness does not.
  const Drawing waves = [](CellIndex cell) {
    return std::vector<Level>{{.z_m = (cell.x + cell.y) % 2 == 0 ? 0.1 : -0.1}};
  };
  const TraversabilityLimits smooth = {.max_step_m = 0.3, .max_roughness_m = 0.05};
  const TraversabilityLimits rough = {.max_step_m = 0.3, .max_roughness_m = 0.15};
  EXPECT_EQ(SurfaceAt(Annotated(waves, smooth), {128, 128}).traversability, kNo);
  EXPECT_EQ(SurfaceAt(Annotated(waves, rough), {128, 128}).traversability, kYes);
}

TEST(TraversabilityTest, NormalSlopeAndRoughnessOfAPlantedPlane) {
  const double gx = 0.21;
  const double gy = -0.14;
  const SurfaceWorld world = Draw(
      [=](CellIndex cell) {
        return std::vector<Level>{{.z_m = gx * X(cell) + gy * Y(cell) + 7.0}};
      },
      108,
      148,
      108,
      148);
  const auto& [key, tile] = *world.begin();
  const Eigen::Vector3d truth = Eigen::Vector3d(-gx, -gy, 1.0).normalized();
  for (const SurfaceAssessment& a : AssessSurfaces(tile, NeighboursOf(world, key), kCell, {})) {
    EXPECT_LT((a.normal.cast<double>() - truth).norm(), 1e-5);
    EXPECT_NEAR(a.slope_rad, std::acos(truth.z()), 1e-5);
    EXPECT_LT(a.roughness_m, 1e-5);
  }
  const std::vector<SurfaceAssessment> all =
      AssessSurfaces(tile, NeighboursOf(world, key), kCell, {});
  EXPECT_NEAR(all[20 * 40 + 20].step_m, (gx - gy) * kCell - 3.0 * 0.002 * std::sqrt(2.0), 1e-5);
  for (const Eigen::Vector3f& normal : EstimateNormals(tile, NeighboursOf(world, key), kCell)) {
    EXPECT_LT((normal.cast<double>() - truth).norm(), 1e-5);
  }
}

TEST(TraversabilityTest, DangerIsOneForEachLimitReachedAndBounded) {
  const TraversabilityLimits limits;
  EXPECT_DOUBLE_EQ(Danger(0.0, 0.0, 0.0, 0.0, limits), 0.0);
  EXPECT_DOUBLE_EQ(Danger(0.35, 0.0, 0.0, 0.0, limits), 1.0);
  EXPECT_DOUBLE_EQ(Danger(0.35, 0.08, 0.15, 0.15, limits), 4.0);
  EXPECT_DOUBLE_EQ(Danger(0.0, 0.04, 0.0, 0.0, limits), 0.25);
  EXPECT_DOUBLE_EQ(Danger(1e9, 1e9, INFINITY, 1e9, limits), 64.0);
  EXPECT_DOUBLE_EQ(Danger(0.1, 0.0, 0.0, 0.0, {.max_slope_rad = 0.0}), 16.0);
}

// Random heights on several levels with holes, so that every rule fires somewhere.
Drawing Rubble(std::uint32_t seed) {
  return [seed](CellIndex cell) {
    std::seed_seq sequence{seed,
                           static_cast<std::uint32_t>(cell.x + 100000),
                           static_cast<std::uint32_t>(cell.y + 100000)};
    std::mt19937 random(sequence);
    std::uniform_real_distribution<double> uniform(0.0, 1.0);
    std::vector<Level> levels;
    const double ground = 0.3 * std::sin(0.1 * cell.x) + 0.2 * std::cos(0.13 * cell.y);
    if (uniform(random) < 0.8) {
      levels.push_back({.z_m = ground + 0.05 * uniform(random), .sigma_m = 0.01});
    }
    if (uniform(random) < 0.3) {
      levels.push_back({.z_m = ground + 2.0, .depth_m = uniform(random) < 0.3 ? 0.8 : 0.0});
    }
    return levels;
  };
}

TEST(TraversabilityTest, TileBordersDoNotShow) {
  // The same drawing twice: cut by tile borders at 0 in x and y, and shifted into the middle.
  for (const int seed : {1, 2, 3}) {
    SCOPED_TRACE(seed);
    const SurfaceWorld cut = Draw(Rubble(seed), -40, 40, -40, 40);
    const SurfaceWorld whole = Draw(
        [seed](CellIndex cell) {
          return Rubble(seed)({cell.x - 128, cell.y - 128});
        },
        88,
        168,
        88,
        168);
    ASSERT_EQ(cut.size(), 4U);
    ASSERT_EQ(whole.size(), 1U);
    const auto& [whole_key, whole_tile] = *whole.begin();
    SurfaceTile expected = whole_tile;
    AnnotateTraversability(expected, NeighboursOf(whole, whole_key), kCell, {});
    int seen[3] = {0, 0, 0};
    std::size_t compared = 0;
    for (const auto& [key, tile] : cut) {
      SurfaceTile annotated = tile;
      AnnotateTraversability(annotated, NeighboursOf(cut, key), kCell, {});
      for (std::size_t i = 0; i < annotated.surfaces.size();) {
        const CellIndex cell = CellOf(key, annotated.surfaces[i].cell);
        for (Surface twin : expected.Cell(CellInTile({cell.x + 128, cell.y + 128}))) {
          twin.cell = annotated.surfaces[i].cell;
          EXPECT_EQ(annotated.surfaces[i], twin) << cell.x << ", " << cell.y;
          ++seen[static_cast<int>(twin.traversability)];
          ++compared;
          ++i;
        }
      }
    }
    EXPECT_EQ(compared, expected.surfaces.size());
    EXPECT_GT(seen[1], 100);
    EXPECT_GT(seen[2], 100);
  }
}

TEST(TraversabilityTest, AnnotationReadsNeitherOldAnnotationNorTheMiddleNeighbour) {
  SurfaceWorld world = Draw(Rubble(5), 0, 60, 0, 60);
  SurfaceTile& tile = world.begin()->second;
  SurfaceNeighbourhood neighbours = NeighboursOf(world, tile.key);
  neighbours[4] = nullptr;
  AnnotateTraversability(tile, neighbours, kCell, {});
  SurfaceTile again = tile;
  AnnotateTraversability(again, NeighboursOf(world, tile.key), kCell, {});
  EXPECT_EQ(again, tile);
}

TEST(TraversabilityTest, EmptyTileStaysEmpty) {
  SurfaceTile tile;
  AnnotateTraversability(tile, {}, kCell, {});
  EXPECT_TRUE(tile.surfaces.empty());
}

}  // namespace
}  // namespace strata
