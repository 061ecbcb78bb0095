#include "core/planes/models/plane_model_codec.h"

#include <limits>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/codec/blob.h"
#include "core/world/plane_model.h"
#include "tests/core/codec/hostile.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

ModelPlane WallWithAWindow() {
  ModelPlane wall;
  wall.id = 3;
  wall.plane = {{0.6, -0.8, 0.0}, -7.5};
  wall.kind = PlaneKind::kWall;
  wall.direction = 1;
  wall.area_m2 = 17.25;
  wall.point_count = 1234;
  wall.rms_m = 0.01;
  wall.sigma_m = 0.001;
  wall.sigma_rad = 0.002;
  PlanePolygon polygon;
  polygon.outer = {{0, 0, 0}, {4, 3, 0}, {4, 3, 2.5}, {0, 0, 2.5}};
  polygon.holes = {{{{1, 0.75, 1}, {1, 0.75, 2}, {2, 1.5, 1}}, true}};
  polygon.area_m2 = 12.0;
  wall.polygons = {polygon, polygon};
  return wall;
}

TEST(PlaneModelCodecTest, TheSameValuesComeBack) {
  const ModelPlane wall = WallWithAWindow();
  const std::string bytes = EncodeModelPlane(wall);
  STRATA_ASSERT_OK_AND_ASSIGN(const ModelPlane back, DecodeModelPlane(bytes));
  EXPECT_EQ(EncodeModelPlane(back), bytes);
  EXPECT_EQ(back.polygons, wall.polygons);
  EXPECT_EQ(back.direction, wall.direction);
  EXPECT_EQ(back.plane.normal, wall.plane.normal);

  PlaneModelInfo info;
  info.job = 4;
  info.epoch = 2;
  info.made = absl::FromUnixMicros(1'700'000'000'000'001);
  info.scans = 5;
  info.points = 6;
  info.planes = 7;
  info.directions = {{{0.0, 0.6, 0.8}, 3, 0.01}};
  STRATA_ASSERT_OK_AND_ASSIGN(const PlaneModelInfo info_back,
                              DecodePlaneModelInfo(EncodePlaneModelInfo(info)));
  EXPECT_EQ(info_back.made, info.made);
  EXPECT_EQ(EncodePlaneModelInfo(info_back), EncodePlaneModelInfo(info));
}

TEST(PlaneModelCodecTest, AColourComesBackAndCostsANewVersionOnlyWhereThereIsOne) {
  ModelPlane wall = WallWithAWindow();
  EXPECT_EQ(VersionOfBlob(EncodeModelPlane(wall)), 1);
  for (const Colour& colour : {Colour{1, 2, 254}, Colour{0, 0, 0}}) {
    wall.colour = colour;
    const std::string bytes = EncodeModelPlane(wall);
    EXPECT_EQ(VersionOfBlob(bytes), 2);
    STRATA_ASSERT_OK_AND_ASSIGN(const ModelPlane back, DecodeModelPlane(bytes));
    EXPECT_EQ(back.colour, colour);
    EXPECT_EQ(back.polygons, wall.polygons);
  }
  testing::ExpectDamageIsDataLoss(EncodeModelPlane(wall), &DecodeModelPlane, 4, 300);
}

TEST(PlaneModelCodecTest, DamageIsDataLoss) {
  testing::ExpectDamageIsDataLoss(EncodeModelPlane(WallWithAWindow()), &DecodeModelPlane, 2, 300);
}

TEST(PlaneModelCodecTest, ForgedBodiesAreRefusedOrHarmless) {
  const int accepted = testing::DecodeForgedBodies(
      BlobKind::kModelPlane, EncodeModelPlane(WallWithAWindow()), &DecodeModelPlane, 3, 2000);
  EXPECT_GT(accepted, 0);
  EXPECT_LT(accepted, 2000);
}

TEST(PlaneModelCodecTest, WhatNoPlaneIsIsFound) {
  const auto refused = [](const ModelPlane& plane) {
    EXPECT_THAT(DecodeModelPlane(EncodeModelPlane(plane)),
                StatusIs(absl::StatusCode::kDataLoss, HasSubstr("out of range")));
  };
  ModelPlane plane = WallWithAWindow();
  plane.rms_m = std::numeric_limits<double>::quiet_NaN();
  refused(plane);
  plane = WallWithAWindow();
  plane.plane.normal *= 2.0;
  refused(plane);
  plane = WallWithAWindow();
  plane.polygons[1].outer.resize(2);
  refused(plane);
  plane = WallWithAWindow();
  plane.kind = static_cast<PlaneKind>(4);
  refused(plane);
}

}  // namespace
}  // namespace strata
