#include "core/api/chunk_check.h"

#include <cstddef>
#include <limits>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/api/scans.h"
#include "tests/support/status_matchers.h"

namespace strata::api {
namespace {

using ::strata::testing::IsOk;
using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

constexpr absl::StatusCode kInvalid = absl::StatusCode::kInvalidArgument;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

PointCloud FullCloud() {
  PointCloud cloud;
  cloud.points = {{1.5F, -2.0F, 3.25F}, {4.0F, 5.0F, -6.0F}};
  cloud.intensity = {0.25F, 1e9F};
  cloud.colour = {{1, 2, 3}, {253, 254, 255}};
  cloud.label = {0, 7};
  return cloud;
}

ScanHeader FullHeader() {
  ScanHeader header;
  header.id = {"run", 1};
  header.point_count = 2;
  header.has_intensity = header.has_colour = header.has_label = true;
  return header;
}

TEST(ChunkCheckTest, WhatWasAnnouncedPasses) {
  EXPECT_THAT(CheckChunk(FullCloud(), FullHeader(), 0), IsOk());
  ScanHeader header;
  PointCloud cloud;
  header.point_count = kMaxPointsPerChunk + 1;
  cloud.points.assign(kMaxPointsPerChunk, {1e6F, -1e6F, 0.0F});
  EXPECT_THAT(CheckChunk(cloud, header, 1), IsOk());
  cloud.points.push_back({0, 0, 0});
  EXPECT_THAT(CheckChunk(cloud, header, 0), StatusIs(kInvalid, HasSubstr("40001 points")));
  EXPECT_THAT(CheckChunk({}, header, 0), StatusIs(kInvalid, HasSubstr("0 points")));
}

// One number of many that is not sound, at every place of a vector.
TEST(ChunkCheckTest, EveryNumberIsLookedAt) {
  ScanHeader header;
  header.point_count = 100;
  PointCloud sound;
  sound.points.assign(100, {1.0F, 2.0F, 3.0F});
  const float infinity = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < 300; ++i) {
    for (const float bad : {kNan, infinity, -infinity, 1.1e6F, -1.1e6F}) {
      PointCloud cloud = sound;
      cloud.points[i / 3][static_cast<Eigen::Index>(i % 3)] = bad;
      EXPECT_THAT(CheckChunk(cloud, header, 0),
                  StatusIs(kInvalid, HasSubstr(absl::StrCat("point ", i / 3, " ("))));
    }
  }
}

TEST(ChunkCheckTest, RefusesAnOriginAndLabelsThatCannotBe) {
  PointCloud cloud = FullCloud();
  cloud.origin.x() = 1.0;
  EXPECT_THAT(CheckChunk(cloud, FullHeader(), 0), StatusIs(kInvalid, HasSubstr("origin")));
  cloud = FullCloud();
  cloud.label[1] = 65535;
  EXPECT_THAT(CheckChunk(cloud, FullHeader(), 0), StatusIs(kInvalid, HasSubstr("65535")));
}

TEST(ChunkCheckTest, RefusesColumnsThatWereNotAnnounced) {
  ScanHeader header = FullHeader();
  header.has_colour = false;
  EXPECT_THAT(CheckChunk(FullCloud(), header, 0), StatusIs(kInvalid, HasSubstr("colour")));
  PointCloud cloud = FullCloud();
  cloud.label.clear();
  EXPECT_THAT(CheckChunk(cloud, FullHeader(), 0), StatusIs(kInvalid, HasSubstr("label")));
}

TEST(ChunkCheckTest, RefusesMorePointsThanAnnounced) {
  EXPECT_THAT(CheckChunk(FullCloud(), FullHeader(), 1),
              StatusIs(kInvalid, HasSubstr("3 points arrived, the header announced 2")));
}

TEST(ChunkCheckTest, NanIsAPixelWithoutReturnInOrganisedScansOnly) {
  PointCloud cloud = FullCloud();
  cloud.points[1] = {kNan, kNan, kNan};
  ScanHeader header = FullHeader();
  EXPECT_THAT(CheckChunk(cloud, header, 0), StatusIs(kInvalid, HasSubstr("point 1 (nan")));
  header.rows = 1;
  header.columns = 2;
  EXPECT_THAT(CheckChunk(cloud, header, 0), IsOk());
  cloud.points[1].x() = 0.0F;
  EXPECT_THAT(CheckChunk(cloud, header, 0), StatusIs(kInvalid, HasSubstr("point 1 (0, nan")));
  cloud.points[1] = {0.0F, 1.1e6F, 0.0F};
  EXPECT_THAT(CheckChunk(cloud, header, 0), StatusIs(kInvalid, HasSubstr("±1e6 m")));
}

}  // namespace
}  // namespace strata::api
