#include "client/formats/plain_readers.h"

#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/file_bytes.h"
#include "client/formats/scan_reader.h"
#include "tests/client/formats/hostile_files.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(XyzReaderTest, ColumnsWithoutNamesGoByTheirNumber) {
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud xyz, ReadXyz("1 2 3\n\n+4\t-5e0   6\r\n"));
  EXPECT_THAT(xyz.points, ElementsAre(Eigen::Vector3f(1, 2, 3), Eigen::Vector3f(4, -5, 6)));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud xyzi, ReadXyz("1,2,3,0.5\n"));
  EXPECT_THAT(xyzi.intensity, ElementsAre(0.5F));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud xyzirgb, ReadXyz("1;2;3;0.5;10;20;30\n"));
  EXPECT_THAT(xyzirgb.colour, ElementsAre(Colour{10, 20, 30}));
}

// "1,2345;-6,7890;0,5000" was a point 2.3 km away, with a colour.
TEST(XyzReaderTest, DecimalCommasAreRefused) {
  EXPECT_THAT(ReadXyz("1,2345;-6,7890;0,5000\n"),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       AllOf(HasSubstr("line 1"), HasSubstr("decimals with points"))));
  STRATA_EXPECT_OK(ReadXyz("# metres; from a, not b\n1.5;2;3\n"));
}

TEST(XyzReaderTest, NamesComeFromALineOrAComment) {
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud csv, ReadXyz("time,z,x,y,nx\n0,3,1,2,9\n"));
  EXPECT_THAT(csv.points, ElementsAre(Eigen::Vector3f(1, 2, 3)));
  STRATA_ASSERT_OK_AND_ASSIGN(
      const PointCloud commented,
      ReadXyz("#Fri Feb 15\n#File format: x y z label_id confidence\n1 2 3 1203 2\n# stray\n"));
  EXPECT_THAT(commented.label, ElementsAre(1203));
}

TEST(OaklandReaderTest, TheFourthColumnIsTheLabelWhereNoneIsNamed) {
  const std::string named =
      "#File format: x y z label_id confidence \n#  1203 -- paved_road\n"
      "-10.5 33.25 4.125 1203 2\n# a comment among points\n-11 33 4 9999 2\n";
  for (const std::string& file : {named, named.substr(named.find("-10.5"))}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadOakland(file));
    EXPECT_THAT(cloud.label, ElementsAre(1203, 9999));
    EXPECT_THAT(cloud.points,
                ElementsAre(Eigen::Vector3f(-10.5, 33.25, 4.125), Eigen::Vector3f(-11, 33, 4)));
    EXPECT_TRUE(cloud.intensity.empty());
  }
  // Far away, floats are about an origin.
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud far,
                              ReadOakland("584000.0625 4477000.125 270 1400 2\n"));
  EXPECT_EQ(far.origin + far.points[0].cast<double>(),
            Eigen::Vector3d(584000.0625, 4477000.125, 270));
  EXPECT_THAT(ReadOakland("1 2 3 1203 2\n1 2 3\n"),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       HasSubstr("line 2: expected 5 numbers, found 3")));
  testing::ExpectSoundOnDamage(named, &ReadOakland, 1);
}

TEST(XyzReaderTest, CountsAndByteOrderMarksBeforeThePointsAreNoPoints) {
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud pts,
                              ReadXyz("2\n1 2 3 -7 10 20 30\n4 5 6 9 1 2 3\n"));
  EXPECT_THAT(pts.points, ElementsAre(Eigen::Vector3f(1, 2, 3), Eigen::Vector3f(4, 5, 6)));
  EXPECT_THAT(pts.intensity, ElementsAre(-7, 9));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud csv, ReadXyz("\xef\xbb\xbfx,y,z\r\n1,2,3\r\n"));
  EXPECT_THAT(csv.points, ElementsAre(Eigen::Vector3f(1, 2, 3)));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud nan, ReadXyz("nan nan nan\n1 2 3\n"));
  EXPECT_THAT(nan.points, ElementsAre(Eigen::Vector3f(1, 2, 3)));
}

TEST(XyzReaderTest, ErrorsNameTheLine) {
  const auto expect = [](const std::string& file, const std::string& message) {
    EXPECT_THAT(ReadXyz(file), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr(message)));
  };
  expect("", "expected points");
  expect("1 2\n", "line 1: points have no field z");
  expect("1 2 3\n4 5\n", "line 2: expected 3 numbers, found 2");
  expect("1 2 3\n4 5 six\n", "line 2: expected numbers only, found 'six'");
  expect("1e400 2 3\n1 2 3\n", "line 1: expected numbers only, found '1e400'");
  expect("1 2 3\n7\n", "line 2: expected 3 numbers, found 1");
  expect("nan nan nan\ninf 1 2\n", "no finite point among 2");
  expect("1 2 3\n1e30 2 3\n", "point (");
  expect("a,b,c\n1,2,3\n", "line 2: points have no field x");
}

TEST(KittiReaderTest, FourFloatsAPoint) {
  const std::string point("\0\0\200\77\0\0\0\100\0\0\100\100\0\0\0\77", 16);
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadKitti(point + point));
  EXPECT_THAT(cloud.points, ElementsAre(Eigen::Vector3f(1, 2, 3), Eigen::Vector3f(1, 2, 3)));
  EXPECT_THAT(cloud.intensity, ElementsAre(0.5F, 0.5F));
  EXPECT_THAT(ReadKitti(point + "x"),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("17 bytes")));
  EXPECT_THAT(ReadKitti(""), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("no finite")));
  testing::ExpectSoundOnDamage(point + point, &ReadKitti, 1);
}

std::string Floats(const std::vector<float>& values) {
  std::string bytes(4 * values.size(), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

// 400 points around a sensor, of nuScenes: x y z intensity ring.
std::string NuscenesFile() {
  std::vector<float> values;
  for (int i = 0; i < 400; ++i) {
    const auto k = static_cast<float>(i);
    const auto ring = static_cast<float>(i % 32);
    values.insert(values.end(), {20.0F * std::sin(k), 20.0F * std::cos(k), -1.5F, k / 4.0F, ring});
  }
  return Floats(values);
}

TEST(NuscenesReaderTest, FiveFloatsAPoint) {
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadNuscenes(NuscenesFile()));
  ASSERT_EQ(cloud.size(), 400U);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    ASSERT_NEAR(cloud.points[i].head<2>().norm(), 20.0F, 1e-4F);
    ASSERT_EQ(cloud.points[i].z(), -1.5F);
    ASSERT_EQ(cloud.intensity[i], static_cast<float>(i) / 4.0F);
  }
  EXPECT_THAT(ReadNuscenes(Floats({1, 2, 3, 4})),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("multiple of 20")));
  testing::ExpectSoundOnDamage(NuscenesFile().substr(0, 60), &ReadNuscenes, 1);
}

TEST(NuscenesReaderTest, TheEndingOfItsNameSaysSo) {
  const testing::TempDir dir;
  STRATA_ASSERT_OK(WriteFileBytes(dir.path() / "LIDAR_TOP.pcd.bin", NuscenesFile()));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScan(dir.path() / "LIDAR_TOP.pcd.bin"));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud named, ReadNuscenes(NuscenesFile()));
  EXPECT_EQ(cloud.points, named.points);
  STRATA_ASSERT_OK(WriteFileBytes(dir.path() / "000000.bin", NuscenesFile()));
  EXPECT_THAT(ReadScan(dir.path() / "000000.bin"),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("--format nuscenes")));
}

// A multiple of both sizes: only the values tell.
TEST(KittiReaderTest, OtherColumnsAreRefusedByTheirValues) {
  std::vector<float> values;
  for (int i = 0; i < 1000; ++i) values.insert(values.end(), {3.0F, 4.0F, 0.5F, 0.25F});
  const auto with_odd = [&](int odd, float value) {
    std::vector<float> some = values;
    for (int i = 0; i < odd; ++i) some[static_cast<std::size_t>(4 * i + 1)] = value;
    return ReadKitti(Floats(some)).status();
  };
  const float nan = std::numeric_limits<float>::quiet_NaN();
  STRATA_EXPECT_OK(with_odd(10, 301.0F));
  STRATA_EXPECT_OK(with_odd(10, nan));
  for (const float value : {301.0F, nan}) {
    EXPECT_THAT(with_odd(11, value),
                StatusIs(absl::StatusCode::kInvalidArgument,
                         AllOf(HasSubstr("11 of 1000 points"), HasSubstr("--format nuscenes"))));
  }
}

// None of its values is odd; 400 points of 20 bytes are 500 of 16.
TEST(KittiReaderTest, RingsTellNuscenes) {
  EXPECT_THAT(ReadKitti(NuscenesFile()),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("--format nuscenes")));
}

TEST(ThreeDtkReaderTest, CentimetresLeftHandedBecomeMetresRightHanded) {
  // 3 m right, 1 m up, 20 m ahead.
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, Read3dtk("300 100 2000 0.25\n"));
  EXPECT_THAT(cloud.points, ElementsAre(Eigen::Vector3f(20, -3, 1)));
  EXPECT_THAT(cloud.intensity, ElementsAre(0.25F));
  EXPECT_THAT(Read3dtk("1 2 3\n1 2\n"),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("line 2")));
  testing::ExpectSoundOnDamage("300 100 2000\n1 2 3\n", &Read3dtk, 1);
}

TEST(ThreeDtkReaderTest, PoseMapsLikeTheLeftHandedOne) {
  // In 3DTK's frame: p_world = Rx Ry Rz p + t, by hand for 90° about y: (x, z) → (z, -x).
  STRATA_ASSERT_OK_AND_ASSIGN(const Pose T, Parse3dtkPose("100 200 300\n0 90 0\n"));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud scan, Read3dtk("10 20 30\n"));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud world, Read3dtk("130 220 290\n"));
  EXPECT_LT((T * scan.points[0].cast<double>() - world.points[0].cast<double>()).norm(), 1e-6);
  EXPECT_THAT(Parse3dtkPose("1 2 3 4 5"),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("three angles")));
}

}  // namespace
}  // namespace strata
