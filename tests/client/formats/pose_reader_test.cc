#include "client/formats/pose_reader.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/file_bytes.h"
#include "tests/support/data_dir.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

class PoseReaderTest : public ::testing::Test {
 protected:
  absl::StatusOr<PoseList> Read(const std::string& text, PoseFormat format = PoseFormat::kAuto) {
    const auto file = dir_.path() / "poses.txt";
    STRATA_EXPECT_OK(WriteFileBytes(file, text));
    return ReadPoses(file, format);
  }
  testing::TempDir dir_;
};

TEST_F(PoseReaderTest, TumIsToldByEightNumbers) {
  STRATA_ASSERT_OK_AND_ASSIGN(const PoseList list,
                              Read("# time x y z\n1630577758.569490 1 2 3 0 0 1 0\n"));
  EXPECT_EQ(list.format, PoseFormat::kTum);
  ASSERT_EQ(list.poses.size(), 1U);
  EXPECT_EQ(list.poses[0].time, absl::FromUnixMicros(1630577758569490));
  EXPECT_FALSE(list.poses[0].index.has_value());
  const Eigen::Vector3d ahead = list.poses[0].T_map_scan * Eigen::Vector3d(1, 0, 0);
  EXPECT_LT((ahead - Eigen::Vector3d(0, 2, 3)).norm(), 1e-12);  // turned by 180° about z
}

TEST_F(PoseReaderTest, IndexTumKeepsIndexAndTime) {
  STRATA_ASSERT_OK_AND_ASSIGN(const PoseList list, Read("12,0.25,1,2,3,0,0,0,1\n"));
  EXPECT_EQ(list.format, PoseFormat::kIndexTum);
  EXPECT_EQ(list.poses[0].index, 12U);
  EXPECT_EQ(list.poses[0].time, absl::FromUnixMillis(250));
}

TEST_F(PoseReaderTest, KittiLinesCountFromZero) {
  STRATA_ASSERT_OK_AND_ASSIGN(const PoseList list,
                              Read("1 0 0 5 0 1 0 6 0 0 1 7\n0 -1 0 1 1 0 0 2 0 0 1 3\n"));
  EXPECT_EQ(list.format, PoseFormat::kKitti);
  ASSERT_EQ(list.poses.size(), 2U);
  EXPECT_EQ(list.poses[1].index, 1U);
  const Eigen::Vector3d ahead = list.poses[1].T_map_scan * Eigen::Vector3d(1, 0, 0);
  EXPECT_LT((ahead - Eigen::Vector3d(1, 3, 3)).norm(), 1e-9);
}

TEST_F(PoseReaderTest, ColumnsMayBeNamed) {
  STRATA_ASSERT_OK_AND_ASSIGN(const PoseList list,
                              Read("\xef\xbb\xbftime,x,y,z,qx,qy,qz,qw\r\n1.5,1,2,3,0,0,0,1\r\n"));
  ASSERT_EQ(list.poses.size(), 1U);
  EXPECT_EQ(list.poses[0].T_map_scan.translation().z(), 3.0);
  for (const char* names :
       {"timestamp tx ty tz qw qx qy qz\n", "# time, x, y, z, q_w, q_x, q_y, q_z\n"}) {
    EXPECT_THAT(Read(std::string(names) + "1 2 3 4 1 0 0 0\n"),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("write w last")))
        << names;
  }
  EXPECT_THAT(Read("1 1 2 3 0 0 0 1\nthen 1 2 3 0 0 0 1\n"),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("found 'then'")));
}

TEST_F(PoseReaderTest, ErrorsNameFileLineAndWhatWasExpected) {
  const auto expect = [this](const std::string& text, const std::string& message) {
    EXPECT_THAT(Read(text), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
    EXPECT_THAT(Read(text), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("poses.txt")));
  };
  expect("", "expected poses");
  expect("1 2 3\n", "line 1: expected 8 (tum), 9 (index-tum) or 12 (kitti) numbers, found 3");
  expect("0 1 2 3 0 0 0 1\n0 1 2\n", "line 2: tum expects 8 numbers, found 3");
  expect("0 1 2 3 0 0 0 2\n", "quaternion has length 2");
  expect("0 1 2 3 0 0 0 nan\n", "found 'nan'");
  expect("0.5 0 1 2 3 0 0 0 1\n", "index 0.5 is no whole number");
  expect("1 0 1 2 3 0 0 0 1\n1 0 1 2 3 0 0 0 1\n", "line 2: index 1 comes twice");
  expect("1 0 0 0 0 1 0 0 0 0 -1 0\n", "no rotation");
  EXPECT_THAT(Read("0 1 2 3 0 0 0 1\n", PoseFormat::kKitti),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("kitti expects 12")));
  EXPECT_THAT(ReadPoses(dir_.path() / "none.txt"),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("none.txt")));
}

TEST(RecordedPosesTest, OfficialKittiPosesInBothFormsAreOneTrajectory) {
  STRATA_REQUIRE_DATA(folder, "kitti00_gt");
  STRATA_ASSERT_OK_AND_ASSIGN(const PoseList cam, ReadPoses(folder / "poses_00_cam0.txt"));
  STRATA_ASSERT_OK_AND_ASSIGN(const PoseList velo, ReadPoses(folder / "poses_00_velo.txt"));
  EXPECT_EQ(cam.format, PoseFormat::kKitti);
  EXPECT_EQ(velo.format, PoseFormat::kIndexTum);
  ASSERT_EQ(cam.poses.size(), 4541U);
  ASSERT_EQ(velo.poses.size(), 4541U);
  // The same motion seen from two sensors 0.3 m apart: rotation angles agree.
  for (const std::size_t i : {10, 1000, 4540}) {
    EXPECT_NEAR(RotationAngleRad(cam.poses[i].T_map_scan),
                RotationAngleRad(velo.poses[i].T_map_scan),
                1e-3);
  }
}

}  // namespace
}  // namespace strata
