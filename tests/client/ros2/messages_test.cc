#include "client/ros2/messages.h"

#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace strata::ros2 {
namespace {

TEST(MessagesTest, CellsAreThoseOfNav2) {
  OccupancyGrid grid;
  grid.width = 4;
  grid.height = 1;
  grid.cells = {GridCell::kFree, GridCell::kOccupied, GridCell::kUnknown, GridCell::kGround};
  EXPECT_THAT(OccupancyOf(grid), ::testing::ElementsAre(0, 100, -1, -1));
}

TEST(MessagesTest, ASurfaceIsAPointInTheMiddleOfItsCell) {
  SurfaceTile tile;
  tile.key = {.x = -1, .y = 0};
  Surface surface;
  surface.cell = 0;  // the lowest x and y
  surface.z_m = 1.5F;
  surface.class_id = 3;
  surface.traversability = Traversability::kTraversable;
  surface.colour = {.r = 1, .g = 2, .b = 3};
  tile.surfaces = {surface};
  const std::string bytes = SurfaceBytes({tile}, 0.2);
  ASSERT_EQ(bytes.size(), kSurfaceBytes);
  float place[3];
  std::uint32_t rgb = 0;
  std::memcpy(place, bytes.data(), sizeof(place));
  std::memcpy(&rgb, bytes.data() + 12, sizeof(rgb));
  EXPECT_FLOAT_EQ(place[0], -256 * 0.2F + 0.1F);
  EXPECT_FLOAT_EQ(place[1], 0.1F);
  EXPECT_FLOAT_EQ(place[2], 1.5F);
  EXPECT_EQ(rgb, 0x010203U);
  EXPECT_EQ(bytes[16], 3);
  EXPECT_EQ(bytes[17], 1);
}

}  // namespace
}  // namespace strata::ros2
