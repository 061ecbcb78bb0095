#include "client/formats/planes/polygon_pieces.h"

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/simulator/plane_room.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

double AreaOfPiece(const FlatPiece& piece, const Vector3d& normal) {
  return testing::DoubleAreaOf({piece.begin(), piece.end()}).dot(normal) / 2.0;
}

double AreaOfPieces(const std::vector<FlatPiece>& pieces, const Vector3d& normal) {
  double area = 0.0;
  for (const FlatPiece& piece : pieces) area += AreaOfPiece(piece, normal);
  return area;
}

// Around the origin in the plane of `u` and `v`, with as many corners, each at its own distance.
PlaneRing Star(const Vector3d& middle,
               const Vector3d& u,
               const Vector3d& v,
               int corners,
               double least_m,
               double most_m,
               std::mt19937& random) {
  std::uniform_real_distribution<double> distance(least_m, most_m);
  PlaneRing ring;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / corners;
    const double r = distance(random);
    ring.emplace_back(middle + r * std::cos(angle) * u + r * std::sin(angle) * v);
  }
  return ring;
}

TEST(PolygonPiecesTest, PiecesHaveTheAreaOfThePolygonAndFaceItsSide) {
  const Eigen::Isometry3d turned = Eigen::Translation3d(500'000.0, -4'000'000.0, 120.0) *
                                   Eigen::AngleAxisd(0.7, Vector3d(0.3, -0.2, 1.0).normalized());
  for (const PlaneModel& model :
       {testing::DrawnRoom(), testing::Moved(testing::DrawnRoom(), turned)}) {
    for (const ModelPlane& plane : model.planes) {
      const auto pieces = PiecesOf(plane.polygons[0], plane.plane.normal);
      EXPECT_NEAR(AreaOfPieces(pieces, plane.plane.normal), plane.area_m2, 1e-3) << plane.id;
      for (const FlatPiece& piece : pieces) {
        EXPECT_GT(AreaOfPiece(piece, plane.plane.normal), 0.0);
        for (const Vector3d& p : piece) {
          EXPECT_NEAR(plane.plane.normal.dot(p), plane.plane.distance, 1e-6);
        }
      }
    }
  }
}

// Each place inside is in one piece, each place outside and in a hole is in none.
TEST(PolygonPiecesTest, PiecesCoverRaggedPolygonsWithHolesOnce) {
  std::mt19937 random(5);
  for (int world = 0; world < 10; ++world) {
    const Vector3d normal = Vector3d::Random().normalized();
    const Vector3d u = normal.unitOrthogonal();
    const Vector3d v = normal.cross(u);
    const Vector3d middle(20.0 * world, -7.0, 3.0);
    std::vector<testing::DrawnHole> holes;
    for (int i = 0; i < 4; ++i) {
      const double angle = std::numbers::pi / 2.0 * i + 0.3;
      const Vector3d at = middle + 3.0 * (std::cos(angle) * u + std::sin(angle) * v);
      holes.push_back({Star(at, u, v, 5 + 6 * i, 0.2, 1.2, random), false});
    }
    const ModelPlane plane = testing::DrawnPlane(
        1, PlaneKind::kSloped, normal, Star(middle, u, v, 200, 4.5, 9.0, random), holes);
    const auto pieces = PiecesOf(plane.polygons[0], normal);
    EXPECT_NEAR(AreaOfPieces(pieces, normal), plane.area_m2, 2e-3);
    EXPECT_LT(pieces.size(), 800U);
    std::uniform_real_distribution<double> place(-9.0, 9.0);
    for (int i = 0; i < 500; ++i) {
      const double along = place(random), across = place(random);
      const Vector3d p = middle + along * u + across * v;
      int in = 0;
      for (const FlatPiece& piece : pieces) {
        in += testing::IsInside({piece.begin(), piece.end()}, p, normal) ? 1 : 0;
      }
      EXPECT_EQ(in, testing::IsInside(plane.polygons[0], p, normal) ? 1 : 0);
    }
  }
}

TEST(PolygonPiecesTest, RingsThatTouchAndWidePolygonsHaveTheirArea) {
  // A hole that touches the border at a corner, and one that touches the other hole.
  const ModelPlane touching = testing::DrawnPlane(
      1,
      PlaneKind::kLevel,
      Vector3d::UnitZ(),
      {{0, 0, 1}, {6, 0, 1}, {6, 6, 1}, {0, 6, 1}},
      {{{{0, 0, 1}, {2, 1, 1}, {1, 2, 1}}, false}, {{{2, 1, 1}, {4, 1, 1}, {4, 3, 1}}, false}});
  EXPECT_NEAR(AreaOfPieces(PiecesOf(touching.polygons[0], Vector3d::UnitZ()), Vector3d::UnitZ()),
              36.0 - 1.5 - 2.0,
              1e-4);
  const double wide = 40'000.0;
  const ModelPlane lake =
      testing::DrawnPlane(1,
                          PlaneKind::kLevel,
                          Vector3d::UnitZ(),
                          {{0, 0, 1}, {wide, 1, 1}, {wide, wide, 1}, {3, wide, 1}},
                          {});
  EXPECT_NEAR(
      AreaOfPieces(PiecesOf(lake.polygons[0], Vector3d::UnitZ()), Vector3d::UnitZ()) / lake.area_m2,
      1.0,
      1e-8);
}

const Eigen::AlignedBox2d kEverywhere(Eigen::Vector2d::Constant(-1e9),
                                      Eigen::Vector2d::Constant(1e9));

// Places are covered where one of the polygons is, within a window or all, and all rings turn as
// they should.
TEST(PolygonPiecesTest, TheUnionIsWhereOneOfThePolygonsIs) {
  std::mt19937 random(8);
  const Vector3d up = Vector3d::UnitZ(), u = Vector3d::UnitX(), v = Vector3d::UnitY();
  EXPECT_TRUE(UnionFromAbove({}, kEverywhere).empty());
  for (int world = 0; world < 5; ++world) {
    const Vector3d far(world * 100'000.0, 0, 2);
    std::vector<ModelPlane> planes;
    for (int i = 0; i < 4; ++i) {
      const Vector3d middle = far + Vector3d(5.0 * i, i == 3 ? 50.0 : 0.0, 0.1 * i);
      const PlaneRing outer = Star(middle, u, v, 30, 3.0, 6.0, random);
      const PlaneRing hole = Star(middle, u, v, 8, 0.5, 2.5, random);
      planes.push_back(testing::DrawnPlane(1, PlaneKind::kLevel, up, outer, {{hole, false}}));
    }
    std::vector<const PlanePolygon*> polygons;
    for (const ModelPlane& plane : planes) polygons.push_back(&plane.polygons[0]);
    const Eigen::Vector2d corner = far.head<2>() + Eigen::Vector2d(-2.5, -3.25);
    const Eigen::AlignedBox2d window(corner, corner + Eigen::Vector2d(11.0, 55.0));
    const Eigen::AlignedBox2d& within = world % 2 == 1 ? window : kEverywhere;
    const auto rings = UnionFromAbove(polygons, within);
    std::uniform_real_distribution<double> x(-6.0, 21.0), y(-6.0, 6.0);
    for (int i = 0; i < 1000; ++i) {
      const double px = x(random), py = y(random);
      const Vector3d p = far + Vector3d(px, py + (i % 4 == 0 ? 50.0 : 0.0), 0);
      double turns = 0.0;
      for (const auto& ring : rings) {
        for (std::size_t k = 0; k < ring.size(); ++k) {
          const Eigen::Vector2d a = ring[k] - p.head<2>();
          const Eigen::Vector2d b = ring[(k + 1) % ring.size()] - p.head<2>();
          turns += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)) / (2.0 * std::numbers::pi);
        }
      }
      bool inside = false;
      for (const PlanePolygon* polygon : polygons) {
        const Vector3d in_plane(p.x(), p.y(), polygon->outer.front().z());
        inside = inside || testing::IsInside(*polygon, in_plane, up);
      }
      inside = inside && within.contains(Eigen::Vector2d(p.head<2>()));
      EXPECT_NEAR(turns, inside ? 1.0 : 0.0, 1e-6);
    }
  }
}

TEST(PolygonPiecesTest, WhatIsNoPolygonIsRefusedByName) {
  STRATA_EXPECT_OK(CheckPlaneModel({}));
  STRATA_EXPECT_OK(CheckPlaneModel(testing::DrawnRoom()));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  PlaneModel model = testing::DrawnRoom();
  model.planes[2].polygons[0].holes[0].ring[1].y() = nan;
  EXPECT_THAT(CheckPlaneModel(model),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("plane 3: corner 2.5, nan")));
  model = testing::DrawnRoom();
  model.planes[0].polygons[0].outer[0].x() = 1e8;
  EXPECT_THAT(CheckPlaneModel(model),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("10,000 km")));
  model = testing::DrawnRoom();
  model.planes[1].polygons[0].outer.resize(2);
  EXPECT_THAT(CheckPlaneModel(model),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("a ring of 2 points")));
  model = testing::DrawnRoom();
  model.planes[1].plane.normal = {0, 0, 2};
  EXPECT_THAT(CheckPlaneModel(model),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("unit length")));
  model = testing::DrawnRoom();
  model.planes[1].rms_m = nan;
  EXPECT_THAT(CheckPlaneModel(model),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("plane 2: rms nan")));
}

}  // namespace
}  // namespace strata
