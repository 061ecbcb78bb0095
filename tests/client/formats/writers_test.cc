#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "client/formats/pcd_reader.h"
#include "client/formats/ply_reader.h"
#include "client/formats/pose_reader.h"
#include "client/formats/pose_writer.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

PointCloud Coloured(double origin) {
  PointCloud cloud;
  cloud.origin = Eigen::Vector3d(origin, 10 * origin, 0);
  cloud.points = {{1, 2, 3}, {4.125F, 5, 6}};
  cloud.intensity = {0.5F, 7};
  cloud.colour = {{1, 2, 3}, {255, 0, 9}};
  cloud.label = {0, 65535};
  return cloud;
}

void ExpectEqual(const absl::StatusOr<PointCloud>& read, const PointCloud& written) {
  STRATA_ASSERT_OK(read);
  EXPECT_EQ(read->points, written.points);
  EXPECT_EQ(read->origin, written.origin);
  EXPECT_EQ(read->intensity, written.intensity);
  EXPECT_EQ(read->colour, written.colour);
  EXPECT_EQ(read->label, written.label);
}

TEST(GeometryWriterTest, PlyAndPcdReadBackTheSameNearAndFar) {
  for (const double origin : {0.0, 500'000.0}) {
    const PointCloud cloud = Coloured(origin);
    STRATA_ASSERT_OK_AND_ASSIGN(const std::string ply, PlyBytes(GeometryOf(cloud)));
    ExpectEqual(ReadPly(ply), cloud);
    STRATA_ASSERT_OK_AND_ASSIGN(const std::string pcd, PcdBytes(GeometryOf(cloud)));
    ExpectEqual(ReadPcd(pcd), cloud);
  }
}

TEST(GeometryWriterTest, MeshesAndPathsHaveTheirElements) {
  Geometry mesh = PathGeometry({{0, 0, 0}, {1, 0, 0}, {1, 1, 0.5}});
  mesh.triangles = {{0, 1, 2}};
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string ply, PlyBytes(mesh));
  EXPECT_THAT(ply, HasSubstr("element face 1\nproperty list uchar int vertex_indices\n"));
  EXPECT_THAT(ply, HasSubstr("element edge 2\nproperty int vertex1\nproperty int vertex2\n"));
  EXPECT_EQ(ply.size() - ply.find("end_header\n") - 11, 3U * 12 + 13 + 2 * 8);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string obj, ObjText(mesh));
  EXPECT_EQ(obj,
            "# metres, z up\nv 0.000000 0.000000 0.000000\nv 1.000000 0.000000 0.000000\n"
            "v 1.000000 1.000000 0.500000\nf 1 2 3\nl 1 2\nl 2 3\n");
}

TEST(GeometryWriterTest, WhatDoesNotFitIsRefused) {
  Geometry geometry = PathGeometry({{0, 0, 0}, {1, 0, 0}});
  geometry.lines.push_back({1, 2});
  EXPECT_THAT(PlyBytes(geometry),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("index 2 of 2 vertices")));
  geometry.lines.clear();
  geometry.colour.resize(1);
  EXPECT_THAT(ObjText(geometry),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("colour has 1 entries")));
}

TEST(PoseWriterTest, TumTextReadsBackToTheLastDigit) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(-0.1, 0.2, -0.3, 0.4).normalized();
  const std::array<TimedPose, 2> poses = {
      {{absl::FromUnixMicros(1630577758569490), MakePose(q, {1234.5678901234, -2, 3e-7})},
       {absl::FromUnixMicros(-1500000), Pose::Identity()}}};
  const std::string text = TumText(poses);
  EXPECT_THAT(text, ::testing::StartsWith("1630577758.569490 1234.567890123400 -2.000000000000 "));
  EXPECT_THAT(text, HasSubstr("\n-1.500000 0.0"));
  testing::TempDir dir;
  STRATA_ASSERT_OK(WriteFileBytes(dir.path() / "poses", text));
  STRATA_ASSERT_OK_AND_ASSIGN(const PoseList list, ReadPoses(dir.path() / "poses"));
  ASSERT_EQ(list.poses.size(), 2U);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(list.poses[i].time, poses[i].time);
    EXPECT_LT((list.poses[i].T_map_scan.matrix() - poses[i].T_map_scan.matrix()).norm(), 1e-11);
  }
}

TEST(FileBytesTest, WhatCannotBeWrittenOrReadSaysWhich) {
  testing::TempDir dir;
  EXPECT_THAT(WriteFileBytes(dir.path() / "no" / "file", "x"),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("no/file")));
  EXPECT_THAT(ReadFileBytes(dir.path()),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("not a file")));
}

TEST(WriteFileBytesTest, ReplacesAFileAsAWholeAndKeepsALink) {
  const testing::TempDir dir;
  const auto file = dir.path() / "file";
  const auto link = dir.path() / "link";
  STRATA_ASSERT_OK(WriteFileBytes(file, "old"));
  std::filesystem::permissions(file, std::filesystem::perms::owner_read);
  std::filesystem::create_symlink(file, link);
  std::ifstream reader(file);
  STRATA_ASSERT_OK(WriteFileBytes(link, "new bytes"));
  std::string seen;
  reader >> seen;
  EXPECT_EQ(seen, "old");  // who had it open still has the whole old file
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_EQ(*ReadFileBytes(file), "new bytes");
  EXPECT_EQ(std::filesystem::status(file).permissions(), std::filesystem::perms::owner_read);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir.path()), {}), 2);
}

TEST(WriteFileBytesTest, FailureNamesFileAndReasonAndLeavesNothing) {
  const testing::TempDir dir;
  EXPECT_THAT(
      WriteFileBytes(dir.path() / "no" / "file", "x"),
      StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("no/file: cannot be written: No")));
  std::filesystem::create_directory(dir.path() / "folder");
  EXPECT_THAT(WriteFileBytes(dir.path() / "folder", "x"),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("Is a directory")));
  EXPECT_THAT(WriteFileBytes("/dev/full", "x"),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("No space left")));
  STRATA_EXPECT_OK(WriteFileBytes("/dev/null", "x"));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir.path()), {}), 1);
}

}  // namespace
}  // namespace strata
