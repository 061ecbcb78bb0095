#include "core/mls/elevation/extended_elevation_map.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <queue>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"
#include "core/mls/elevation/elevation_map.h"
#include "core/mls/mls_map.h"
#include "core/mls/patch.h"
#include "core/mls/surface_tile.h"
#include "core/mls/traversability.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

constexpr double kCell = 0.2;
constexpr double kSigma = 0.004;
constexpr MlsParameters kParameters = {.cell_size_m = kCell};

CellIndex CellAt(double x, double y) {
  return {static_cast<int>(std::floor(x / kCell)), static_cast<int>(std::floor(y / kCell))};
}

// 6.5.2 by the book: all heights of a cell sorted and chained.
MlsMap MapOf(const std::vector<Eigen::Vector3f>& points) {
  std::map<std::pair<TileKey, int>, std::vector<int>> columns;
  for (const Eigen::Vector3f& p : points) {
    const CellIndex cell = CellAt(p.x(), p.y());
    columns[{TileOfCell(cell), CellInTile(cell)}].push_back(
        static_cast<int>(std::lround(p.z() * kTicksPerMetre)));
  }
  MlsMap map = {.parameters = kParameters, .tiles = {}};
  for (auto& [place, heights] : columns) {
    if (map.tiles.empty() || map.tiles.back().key != place.first) {
      map.tiles.emplace_back().key = place.first;
    }
    std::vector<Patch>& patches = map.tiles.back().patches;
    std::sort(heights.begin(), heights.end());
    for (std::size_t i = 0; i < heights.size(); ++i) {
      const Patch one = PatchOfMeasurement(
          static_cast<std::uint16_t>(place.second), heights[i], SigmaCode(kSigma));
      if (i > 0 && Touching(patches.back(), one, kParameters)) {
        patches.back() = Join(patches.back(), one, kParameters);
      } else {
        patches.push_back(one);
      }
    }
  }
  for (MlsTile& tile : map.tiles) tile.IndexRows();
  return map;
}

ExtendedElevationMap ExtendedOf(const MlsMap& map, const TraversabilityLimits& limits) {
  std::vector<SurfaceTile> tiles;
  for (const MlsTile& tile : map.tiles) tiles.push_back(SurfacesOf(tile));
  return *MakeExtendedElevationMap(std::move(tiles), kCell, limits);
}

// The middle of `half` cells to either side that all have these heights.
ExtendedElevationCell MiddleOf(const std::vector<float>& heights, int half, double clearance_m) {
  std::vector<Eigen::Vector3f> points;
  for (int y = -half; y <= half; ++y) {
    for (int x = -half; x <= half; ++x) {
      for (const float z : heights) {
        points.emplace_back(
            0.2F * static_cast<float>(x) + 0.1F, 0.2F * static_cast<float>(y) + 0.1F, z);
      }
    }
  }
  return *ExtendedOf(MapOf(points), {.clearance_m = clearance_m}).Find({0, 0});
}

ElevationClass ClassOfOnly(const std::vector<float>& heights) {
  return MiddleOf(heights, 0, 1.0).elevation_class;
}

TEST(ExtendedElevationMapTest, ClassesOfSingleCells) {
  // Alone, nothing says that a horizontal cell is planar.
  EXPECT_EQ(ClassOfOnly({0.0F, 0.05F}), ElevationClass::kNonTraversable);
  EXPECT_EQ(ClassOfOnly({0.0F, 0.5F}), ElevationClass::kVertical);
  EXPECT_EQ(ClassOfOnly({0.0F, 0.8F, 1.6F}), ElevationClass::kVertical);
  EXPECT_EQ(ClassOfOnly({0.0F, 2.5F}), ElevationClass::kNonTraversable);
  EXPECT_EQ(MiddleOf({0.0F, 2.5F}, 3, 1.0).elevation_class, ElevationClass::kGap);
}

TEST(ExtendedElevationMapTest, GapNeedsRoomForTheRobotAndGivesTheLowestSuchSurface) {
  const auto find = [](double clearance_m) {
    return MiddleOf({0.0F, 1.2F, 3.5F, 6.5F}, 3, clearance_m);
  };
  EXPECT_EQ(find(1.1).elevation_class, ElevationClass::kGap);
  EXPECT_NEAR(find(1.1).z_m, 0.0, 1e-6);
  EXPECT_NEAR(find(2.0).z_m, 1.2, 1e-3);
  EXPECT_NEAR(find(2.9).z_m, 3.5, 1e-3);
  EXPECT_EQ(find(4.0).elevation_class, ElevationClass::kVertical);
  EXPECT_NEAR(find(4.0).z_m, 6.5, 1e-3);
  EXPECT_NEAR(find(4.0).depth_m, 6.5, 1e-3);
  EXPECT_EQ(find(1.1).depth_m, 0.0F);
}

// Flat ground with a canopy above it, 4 m high, and something beneath in the middle row of cells.
ExtendedElevationCell UnderACanopy(const std::vector<float>& middle) {
  std::vector<Eigen::Vector3f> points;
  for (int y = -5; y <= 5; ++y) {
    for (int x = -5; x <= 5; ++x) {
      const auto add = [&](float z) {
        points.emplace_back(
            0.2F * static_cast<float>(x) + 0.1F, 0.2F * static_cast<float>(y) + 0.1F, z);
      };
      if (x == 0) std::for_each(middle.begin(), middle.end(), add);
      if (x != 0) add(0.0F);
      add(4.0F);
    }
  }
  return *ExtendedOf(MapOf(points), {}).Find({0, 0});
}

TEST(ExtendedElevationMapTest, AGapIsPassableWhereItsGroundIs) {
  EXPECT_EQ(UnderACanopy({0.0F}).elevation_class, ElevationClass::kGap);
  EXPECT_NEAR(UnderACanopy({0.0F}).z_m, 0.0, 1e-6);
  // A hedge of 0.8 m. Its top cannot be driven on, the canopy's can.
  const ExtendedElevationCell hedge = UnderACanopy({0.0F, 0.2F, 0.4F, 0.6F, 0.8F});
  EXPECT_EQ(hedge.elevation_class, ElevationClass::kGap);
  EXPECT_NEAR(hedge.z_m, 4.0, 1e-3);
}

TEST(ExtendedElevationMapTest, AGapWithoutGroundIsNotPassable) {
  std::vector<Eigen::Vector3f> points;
  for (int y = -5; y <= 5; ++y) {
    for (int x = -5; x <= 5; ++x) {
      const Eigen::Vector3f at(
          0.2F * static_cast<float>(x) + 0.1F, 0.2F * static_cast<float>(y) + 0.1F, 0.0F);
      if (x == 0) {
        for (const float z : {0.2F, 0.4F, 0.6F, 0.8F}) points.emplace_back(at.x(), at.y(), z);
      }
      points.push_back(at);
      points.emplace_back(at.x(), at.y(), (x + y) % 2 == 0 ? 4.0F : 4.5F);  // branches
    }
  }
  const ExtendedElevationCell hedge = *ExtendedOf(MapOf(points), {}).Find({0, 0});
  EXPECT_EQ(hedge.elevation_class, ElevationClass::kNonTraversable);
  EXPECT_NEAR(hedge.z_m, 0.8, 1e-3);
  EXPECT_FALSE(hedge.passable());
}

TEST(ExtendedElevationMapTest, WhatWasSeenFromBelowOnlyIsNoGround) {
  SurfaceTile ceiling;
  ceiling.key = {0, 0, 0};
  for (int y = 0; y < 12; ++y) {
    for (int x = 0; x < 12; ++x) {
      const std::uint16_t cell = CellInTile({x, y});
      const bool below = x < 6;
      if (below) ceiling.surfaces.push_back({.cell = cell, .z_m = 0.0F, .sigma_m = 0.004F});
      ceiling.surfaces.push_back({.cell = cell,
                                  .traversability = Traversability::kUnderside,
                                  .z_m = 3.0F,
                                  .sigma_m = 0.004F});
    }
  }
  ceiling.IndexRows();
  STRATA_ASSERT_OK_AND_ASSIGN(const ExtendedElevationMap map,
                              MakeExtendedElevationMap({ceiling}, kCell, {}));
  EXPECT_EQ(map.Find({3, 6})->elevation_class, ElevationClass::kGap);
  EXPECT_EQ(map.Find({3, 6})->z_m, 0.0F);
  EXPECT_EQ(map.Find({9, 6})->elevation_class, ElevationClass::kNonTraversable);
  const Stop stop;
  stop.Request();
  EXPECT_EQ(MakeExtendedElevationMap({ceiling}, kCell, {}, stop).status().code(),
            absl::StatusCode::kCancelled);
}

// The world of Fig. 6.1: flat ground, a road under a bridge (|x| ≤ 2, along y) whose deck, 3.0 to
// 3.4 m high, is reached by earth ramps from x = ±14, with retaining walls below its ends.
double RoadHeight(double x) {
  const double beyond = std::max(0.0, std::abs(x) - 2.0);
  return std::max(0.0, 3.4 - 0.28 * beyond);
}

std::vector<Eigen::Vector3f> BridgeCloud() {
  std::mt19937 random(61);
  std::normal_distribution<float> noise(0.0F, static_cast<float>(kSigma));
  std::vector<Eigen::Vector3f> points;
  const auto add = [&](double x, double y, double z) {
    points.emplace_back(
        static_cast<float>(x), static_cast<float>(y), static_cast<float>(z) + noise(random));
  };
  for (double x = -15.95; x < 16.0; x += 0.1) {
    for (double y = -7.95; y < 8.0; y += 0.1) {
      const bool on_road = std::abs(y) < 3.0;
      const bool under = std::abs(x) < 2.0;
      if (on_road) add(x, y, RoadHeight(x));
      if (on_road && under) add(x, y, 3.0);
      if (!on_road || under) add(x, y, 0.0);
    }
  }
  // Retaining walls: below the deck's ends, and along the sides of the ramps.
  for (double z = 0.05; z < 3.4; z += 0.05) {
    for (double y = -2.95; y < 3.0; y += 0.1) {
      for (const double x : {-2.05, 2.05}) add(x, y, z);
    }
    for (double x = -15.95; x < 16.0; x += 0.1) {
      if (std::abs(x) < 2.0 || z > RoadHeight(x)) continue;
      for (const double y : {-2.95, 2.95}) add(x, y, z);
    }
  }
  return points;
}

// Whether a breadth-first walk over passable places, `neighbours` of each, joins two of them.
template <typename Place, typename Neighbours>
bool Joined(const Place& from, const Place& to, Neighbours neighbours) {
  std::set<Place> seen = {from};
  std::queue<Place> open;
  open.push(from);
  while (!open.empty()) {
    const Place place = open.front();
    open.pop();
    if (place == to) return true;
    for (const Place& next : neighbours(place)) {
      if (seen.insert(next).second) open.push(next);
    }
  }
  return false;
}

constexpr CellIndex kSteps[] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};

// Four walks: the road over the bridge and the path under it.
struct Walks {
  bool over = false;
  bool under = false;
  friend bool operator==(const Walks&, const Walks&) = default;
};
void PrintTo(const Walks& walks, std::ostream* os) {
  *os << "over " << walks.over << ", under " << walks.under;
}

const CellIndex kWest = CellAt(-15.3, 0.1);
const CellIndex kEast = CellAt(15.3, 0.1);
const CellIndex kSouth = CellAt(0.1, -7.3);
const CellIndex kNorth = CellAt(0.1, 7.3);

// Over a map of one height a cell. height(cell) returns false where nobody may go. The walls along
// the way keep the two walks apart but for the bridge itself: staying within its strip is asked
// for.
template <typename Height>
Walks WalksOnOneLevel(Height height) {
  const auto within = [&](double half_x, double half_y) {
    return [=](const CellIndex& cell) {
      std::vector<CellIndex> next;
      double z = 0.0;
      height(cell, z);
      for (const CellIndex& step : kSteps) {
        const CellIndex other = {cell.x + step.x, cell.y + step.y};
        double other_z = 0.0;
        const bool strip = std::abs(other.x) * kCell < half_x && std::abs(other.y) * kCell < half_y;
        if (strip && height(other, other_z) && std::abs(other_z - z) < 0.2) next.push_back(other);
      }
      return next;
    };
  };
  return {.over = Joined(kWest, kEast, within(100.0, 2.9)),
          .under = Joined(kSouth, kNorth, within(2.0, 100.0))};
}

TEST(Figure61Test, ElevationMapBlocksTheUnderpassExtendedOpensItAndMlsHasBoth) {
  const std::vector<Eigen::Vector3f> points = BridgeCloud();

  PointCloud cloud;
  cloud.points = points;
  STRATA_ASSERT_OK_AND_ASSIGN(const ElevationMap elevation,
                              InsertForward(cloud,
                                            Pose::Identity(),
                                            {.sigma_m = kSigma, .sigma_per_metre = 0.0},
                                            kCell,
                                            ElevationRule::kHighest));
  const Walks by_elevation = WalksOnOneLevel([&](const CellIndex& cell, double& z) {
    z = elevation.At(cell).z_m;
    return elevation.At(cell).observed();
  });
  EXPECT_EQ(by_elevation, (Walks{.over = true, .under = false}));

  const MlsMap map = MapOf(points);
  const ExtendedElevationMap extended = ExtendedOf(map, {});
  const Walks by_extended = WalksOnOneLevel([&](const CellIndex& cell, double& z) {
    const ExtendedElevationCell* found = extended.Find(cell);
    if (found == nullptr) return false;
    z = found->z_m;
    return found->passable();
  });
  EXPECT_EQ(by_extended, (Walks{.over = false, .under = true}));

  std::map<TileKey, SurfaceTile> tiles;
  for (const MlsTile& tile : map.tiles) tiles[tile.key] = SurfacesOf(tile);
  for (auto& [key, tile] : tiles) {
    SurfaceNeighbourhood around{};
    for (int i = 0; i < 9; ++i) {
      const auto it = tiles.find({0, key.x + i % 3 - 1, key.y + i / 3 - 1});
      around[i] = it == tiles.end() ? nullptr : &it->second;
    }
    AnnotateTraversability(tile, around, kCell, {});
  }
  // A place is a cell and the level in it, lowest first.
  using Place = std::pair<CellIndex, int>;
  const auto column = [&](const CellIndex& cell) {
    const auto it = tiles.find(TileOfCell(cell));
    return it == tiles.end() ? std::span<const Surface>() : it->second.Cell(CellInTile(cell));
  };
  const auto neighbours = [&](const Place& place) {
    std::vector<Place> next;
    const float z = column(place.first)[place.second].z_m;
    for (const CellIndex& step : kSteps) {
      const CellIndex other = {place.first.x + step.x, place.first.y + step.y};
      const std::span<const Surface> surfaces = column(other);
      for (int level = 0; level < static_cast<int>(surfaces.size()); ++level) {
        const bool yes = surfaces[level].traversability == Traversability::kTraversable;
        if (yes && std::abs(surfaces[level].z_m - z) < 0.15F) next.emplace_back(other, level);
      }
    }
    return next;
  };
  EXPECT_TRUE(Joined(Place{kWest, 0}, Place{kEast, 0}, neighbours));
  EXPECT_TRUE(Joined(Place{kSouth, 0}, Place{kNorth, 0}, neighbours));
  const CellIndex middle = CellAt(0.1, 0.1);
  ASSERT_EQ(column(middle).size(), 2U);
  EXPECT_TRUE(Joined(Place{kWest, 0}, Place{middle, 1}, neighbours));
  EXPECT_TRUE(Joined(Place{kSouth, 0}, Place{middle, 0}, neighbours));
}

TEST(Figure61Test, ClassesAreThoseOfFigure63) {
  const ExtendedElevationMap map = ExtendedOf(MapOf(BridgeCloud()), {});
  const auto class_at = [&](double x, double y) { return map.Find(CellAt(x, y))->elevation_class; };
  EXPECT_EQ(class_at(0.1, -6.1), ElevationClass::kTraversable);
  EXPECT_EQ(class_at(8.1, 0.1), ElevationClass::kTraversable);  // the ramp
  EXPECT_EQ(class_at(0.1, 0.1), ElevationClass::kGap);
  EXPECT_EQ(class_at(2.1, 0.1), ElevationClass::kVertical);         // retaining wall
  EXPECT_EQ(class_at(6.1, -2.9), ElevationClass::kVertical);        // side of the ramp
  EXPECT_EQ(class_at(6.1, -3.1), ElevationClass::kNonTraversable);  // foot of that wall
  EXPECT_EQ(map.Find(CellAt(50.0, 0.0)), nullptr);
}

}  // namespace
}  // namespace strata
