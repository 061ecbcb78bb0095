#include "core/planes/models/plane_model_finder.h"

#include <cmath>
#include <cstddef>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/common/stop.h"
#include "core/geometry/primitives.h"
#include "core/planes/models/alpha_polygons.h"
#include "core/planes/models/plane_polygons.h"
#include "core/world/constraint.h"
#include "core/world/plane_model.h"
#include "tests/support/simulator/simulator.h"

namespace strata {
namespace {

using testing::Random;

// A wall at x = 2, 6 m long and 3 m high, with a window of 1.5 × 1 m, and a floor of 4 × 6 m.
PosedPoints WallAndFloor(double turn_rad) {
  Random random(1);
  PosedPoints points;
  const Eigen::AngleAxisd turn(turn_rad, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d sensor(0.0, 0.0, 1.5);
  points.origin = {100.0, -50.0, 0.0};
  const auto add = [&](const Eigen::Vector3d& p) {
    points.points.push_back((turn * p).cast<float>());
  };
  for (int i = 0; i < 60000; ++i) {
    const double y = random.Uniform(-3.0, 3.0), z = random.Uniform(0.0, 3.0);
    if (std::abs(y) < 0.75 && z > 1.0 && z < 2.0) {
      // Through the window to a wall far behind it.
      const Eigen::Vector3d way(2.0, y, z - 1.5);
      add(sensor + way * 4.0);
      continue;
    }
    add({2.0 + 0.01 * random.Gaussian(), y, z});
  }
  for (int i = 0; i < 60000; ++i) {
    add({random.Uniform(-2.0, 2.0), random.Uniform(-3.0, 3.0), 0.01 * random.Gaussian()});
  }
  points.views = {{(turn * sensor).cast<float>(), points.points.size()}};
  return points;
}

TEST(AlphaPolygons, KeepAHole) {
  std::vector<Eigen::Vector2d> grid;
  for (int i = 0; i <= 40; ++i) {
    for (int j = 0; j <= 40; ++j) {
      if (i > 10 && i < 20 && j > 10 && j < 20) continue;  // open from 1.0 to 2.0
      grid.emplace_back(0.1 * i, 0.1 * j);
    }
  }
  grid.emplace_back(9.0, 9.0);
  const std::vector<FlatPolygon> shapes = AlphaPolygons(grid, 0.25);
  ASSERT_EQ(shapes.size(), 1U);
  ASSERT_EQ(shapes[0].holes.size(), 1U);
  EXPECT_NEAR(SignedArea(shapes[0].outer), 16.0, 1e-3);
  // The corners of a hole are cut: a triangle of legs 0.2 m there has a circle of 0.14 m.
  EXPECT_NEAR(SignedArea(shapes[0].holes[0]), -(1.0 - 4 * 0.02), 1e-3);
}

// Sparse points make regions that touch themselves everywhere.
TEST(AlphaPolygons, RingsComeToAPointOnce) {
  Random random(3);
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < 3000; ++i) {
    points.emplace_back(random.Uniform(0.0, 8.0), random.Uniform(0.0, 8.0));
  }
  std::size_t holes = 0;
  for (const FlatPolygon& shape : AlphaPolygons(points, 0.12)) {
    EXPECT_TRUE(IsValid(shape));
    holes += shape.holes.size();
    std::vector<FlatRing> rings = shape.holes;
    rings.push_back(shape.outer);
    for (const FlatRing& ring : rings) {
      std::set<std::pair<double, double>> places;
      for (const Eigen::Vector2d& p : ring) EXPECT_TRUE(places.insert({p.x(), p.y()}).second);
    }
  }
  EXPECT_GT(holes, 20U);
}

TEST(FindPlaneModel, WallWithWindowMeetsTheFloor) {
  const PosedPoints points = WallAndFloor(0.4);
  PlaneModelOptions options;
  const absl::StatusOr<PlaneModel> model = FindPlaneModel(points, options, Stop());
  ASSERT_TRUE(model.ok()) << model.status();
  const ModelPlane *wall = nullptr, *floor = nullptr;
  for (const ModelPlane& plane : model->planes) {
    const double off = std::abs(SignedDistance({100.0, -50.0, 1.5}, plane.plane));
    if (plane.kind == PlaneKind::kWall && off < 3.0) wall = &plane;
    if (plane.kind == PlaneKind::kLevel && floor == nullptr) floor = &plane;
  }
  ASSERT_NE(wall, nullptr);
  ASSERT_NE(floor, nullptr);
  const Eigen::Vector3d truth(-std::cos(0.4), -std::sin(0.4), 0.0);  // towards the sensor
  EXPECT_GT(wall->plane.normal.dot(truth), std::cos(0.003));
  EXPECT_GT(floor->plane.normal.z(), std::cos(0.003));
  EXPECT_NEAR(SignedDistance({100.0, -50.0, 0.0}, floor->plane), 0.0, 0.002);
  ASSERT_EQ(wall->polygons.size(), 1U);
  ASSERT_EQ(wall->polygons[0].holes.size(), 1U);
  EXPECT_TRUE(wall->polygons[0].holes[0].seen_open);
  EXPECT_NEAR(wall->polygons[0].area_m2, 18.0 - 1.5, 0.8);
  ASSERT_EQ(floor->polygons.size(), 1U);
  EXPECT_NEAR(floor->polygons[0].area_m2, 24.0, 0.8);
  EXPECT_TRUE(floor->polygons[0].holes.empty());
}

// A wall of 6 x 3 m at x = 2 with `count` points and a round hole; rays go through it to a wall far
// behind, or none do.
PosedPoints WallWithPorthole(int count, double radius_m, bool seen_open) {
  Random random(2);
  PosedPoints points;
  const Eigen::Vector3d sensor(0.0, 0.0, 1.5);
  for (int i = 0; i < count; ++i) {
    const double y = random.Uniform(-3.0, 3.0), z = random.Uniform(0.0, 3.0);
    const double noise = 0.01 * random.Gaussian();
    const bool hole = std::hypot(y - 0.8, z - 1.6) < radius_m;
    if (hole && !seen_open) continue;
    const Eigen::Vector3d way = Eigen::Vector3d(2.0 + noise, y, z) - sensor;
    points.points.push_back((sensor + (hole ? 4.0 : 1.0) * way).cast<float>());
  }
  points.views = {{sensor.cast<float>(), points.points.size()}};
  return points;
}

std::vector<PlaneHole> HolesOfWall(const PosedPoints& points) {
  const auto model = FindPlaneModel(points, {}, Stop());
  EXPECT_TRUE(model.ok()) << model.status();
  std::vector<PlaneHole> holes;
  for (const ModelPlane& plane : model->planes) {
    if (std::abs(plane.plane.distance) > 3.0) continue;
    double area_m2 = 0.0;
    for (const PlanePolygon& polygon : plane.polygons) {
      holes.insert(holes.end(), polygon.holes.begin(), polygon.holes.end());
      area_m2 += polygon.area_m2;
    }
    EXPECT_NEAR(area_m2, 18.0, 2.0);
  }
  return holes;
}

TEST(FindPlaneModel, SmallHolesAreThoseThatRaysWentThrough) {
  const std::vector<PlaneHole> open = HolesOfWall(WallWithPorthole(60000, 0.275, true));
  ASSERT_EQ(open.size(), 1U);
  EXPECT_TRUE(open[0].seen_open);
  EXPECT_TRUE(HolesOfWall(WallWithPorthole(60000, 0.275, false)).empty());
  // 40 points a square metre leave circles of more than 0.25 m here and there.
  EXPECT_TRUE(HolesOfWall(WallWithPorthole(720, 0.0, false)).empty());
}

TEST(FindPlaneModel, SaysTheSameTwice) {
  const PosedPoints points = WallAndFloor(0.0);
  const auto a = FindPlaneModel(points, {}, Stop());
  const auto b = FindPlaneModel(points, {}, Stop());
  ASSERT_TRUE(a.ok() && b.ok());
  ASSERT_EQ(a->planes.size(), b->planes.size());
  for (std::size_t i = 0; i < a->planes.size(); ++i) {
    EXPECT_EQ(a->planes[i].plane.normal, b->planes[i].plane.normal);
    EXPECT_EQ(a->planes[i].polygons, b->planes[i].polygons);
  }
}

TEST(FindPlaneModel, EndsWhereOutlinesTakeTooMuchMemory) {
  PlaneModelOptions options;
  options.max_outline_bytes = 100'000;
  const auto model = FindPlaneModel(WallAndFloor(0.0), options, Stop());
  EXPECT_TRUE(absl::IsResourceExhausted(model.status())) << model.status();
  EXPECT_NE(model.status().message().find("epsilon_m"), std::string::npos);
}

constexpr Colour kStone = {150, 150, 145}, kRed = {165, 45, 40};

// A floor of 6 x 6 m under a carpet of 2 x 1.5 m that is 5 mm thick.
PosedPoints FloorWithCarpet() {
  Random random(6);
  PosedPoints points;
  for (int i = 0; i < 80000; ++i) {
    const double x = random.Uniform(-3.0, 3.0), y = random.Uniform(-3.0, 3.0);
    const bool carpet = std::abs(x) < 1.0 && std::abs(y) < 0.75;
    const double z = (carpet ? 0.005 : 0.0) + 0.01 * random.Gaussian();
    points.points.push_back(Eigen::Vector3d(x, y, z).cast<float>());
    points.colour.push_back(carpet ? kRed : kStone);
  }
  points.views = {{{0.0F, 0.0F, 1.5F}, points.points.size()}};
  return points;
}

TEST(FindPlaneModel, ByItsColourACarpetIsAPlaneOfItsOwn) {
  PosedPoints points = FloorWithCarpet();
  PlaneModelOptions options;
  options.colour = true;
  const auto model = FindPlaneModel(points, options, Stop());
  ASSERT_TRUE(model.ok()) << model.status();
  ASSERT_EQ(model->planes.size(), 2U);
  const ModelPlane &floor = model->planes[0], &carpet = model->planes[1];
  EXPECT_EQ(floor.colour, kStone);
  EXPECT_EQ(carpet.colour, kRed);
  EXPECT_NEAR(floor.plane.distance, 0.0, 0.001);
  EXPECT_NEAR(carpet.plane.distance, 0.005, 0.001);
  ASSERT_EQ(carpet.polygons.size(), 1U);
  EXPECT_NEAR(carpet.polygons[0].area_m2, 3.0, 0.3);
  ASSERT_EQ(floor.polygons.size(), 1U);
  EXPECT_NEAR(floor.polygons[0].area_m2, 33.0, 1.0);
  EXPECT_EQ(floor.polygons[0].holes.size(), 1U);

  options.colour = false;
  points.colour.clear();
  const auto plain = FindPlaneModel(points, options, Stop());
  ASSERT_TRUE(plain.ok()) << plain.status();
  ASSERT_EQ(plain->planes.size(), 1U);
  EXPECT_EQ(plain->planes[0].colour, std::nullopt);
}

TEST(FindPlaneModel, EveryPointNeedsAColourWhereTheyCount) {
  PosedPoints points = FloorWithCarpet();
  PlaneModelOptions options;
  EXPECT_TRUE(absl::IsInvalidArgument(FindPlaneModel(points, options, Stop()).status()));
  points.colour.pop_back();
  options.colour = true;
  EXPECT_TRUE(absl::IsInvalidArgument(FindPlaneModel(points, options, Stop()).status()));
}

TEST(FindPlaneModel, NothingGivesNothing) {
  const auto model = FindPlaneModel({}, {}, Stop());
  ASSERT_TRUE(model.ok()) << model.status();
  EXPECT_TRUE(model->planes.empty());
}

}  // namespace
}  // namespace strata
