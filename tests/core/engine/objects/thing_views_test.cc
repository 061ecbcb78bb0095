#include "core/engine/objects/thing_views.h"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/geometry/pose.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using ::testing::SizeIs;

// A piece of a window of 1.2 × 1.5 m that stands at (x, 0).
Entity PieceAt(std::uint64_t id, double x, double from_middle_m, std::uint64_t points) {
  Entity piece;
  piece.id = id;
  piece.box.centre = {x + from_middle_m, 0.0, 0.75};
  piece.box.size = {0.5, 0.1, 1.5};
  piece.points = points;
  piece.scans = {{{"run", 1}, points}};
  piece.kind.emplace().id = 7;
  piece.kind->T_map_kind.translation() = Vector3d(x, 0.0, 0.0);
  return piece;
}

TEST(WholeThingsTest, PiecesInOnePlaceAreOneThing) {
  std::vector<Entity> entities = {
      PieceAt(1, 0.0, -0.3, 300), PieceAt(2, 2.0, 0.0, 200), PieceAt(3, 0.05, 0.3, 100)};
  entities[2].scans = {{{"run", 1}, 60}, {{"run", 2}, 40}};
  const std::vector<WholeThing> things = WholeThingsOf(entities);
  ASSERT_THAT(things, SizeIs(2));
  EXPECT_EQ(things[0].entity.id, 1U);
  EXPECT_EQ(things[0].entity.points, 400U);
  ASSERT_THAT(things[0].entity.scans, SizeIs(2));
  EXPECT_EQ(things[0].entity.scans[0].points, 360U);
  EXPECT_EQ(things[0].entity.scans[1].points, 40U);
  EXPECT_THAT(things[0].boxes, SizeIs(2));
  EXPECT_THAT(things[1].boxes, SizeIs(1));
  const Eigen::AlignedBox3d box = BoxOfKind(things);
  EXPECT_NEAR(box.sizes().x(), 0.6 + 0.05 + 0.5 + 0.4, 1e-9);
}

TEST(WholeThingsTest, ThoseThatAreTurnedOrMovedAreTwo) {
  std::vector<Entity> entities = {PieceAt(1, 0.0, -0.3, 300), PieceAt(2, 0.0, 0.3, 100)};
  entities[1].kind->T_map_kind.linear() =
      Eigen::AngleAxisd(1.0, Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_THAT(WholeThingsOf(entities), SizeIs(2));
  entities[1] = PieceAt(2, 0.6, 0.3, 100);
  EXPECT_THAT(WholeThingsOf(entities), SizeIs(2));
  // Small things stand closer to each other than parts of one are off.
  for (Entity& entity : entities) entity.box.size = {0.2, 0.1, 0.2};
  entities[1].kind->T_map_kind.translation() = Vector3d(0.15, 0.0, 0.0);
  EXPECT_THAT(WholeThingsOf(entities), SizeIs(2));
}

}  // namespace
}  // namespace strata
