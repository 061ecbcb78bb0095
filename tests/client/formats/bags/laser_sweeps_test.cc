// A laser that tilts on a robot that drives and turns through a room: what its lines make.
#include "client/formats/bags/laser_sweeps.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/bags/bag_scans.h"
#include "client/formats/file_bytes.h"
#include "tests/support/bag_writer.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::strata::testing::BagEntry;
using ::strata::testing::Layout;
using ::strata::testing::StatusIs;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr std::int64_t kStartNs = 1'700'000'000'000'000'000;
constexpr double kStepS = 1e-4;  // from beam to beam
constexpr int kBeams = 181;
constexpr double kDriveS = 6.5;

constexpr char kRobot[] = R"(<robot name="r">
  <link name="base"/><link name="plate"/><link name="laser"/>
  <joint name="tilt" type="revolute"><parent link="base"/><child link="plate"/>
    <origin xyz="0.3 0 0.8"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="mount" type="fixed"><parent link="plate"/><child link="laser"/>
    <origin xyz="0.05 0 0.1"/></joint>
</robot>)";

double TiltAt(double t_s) { return 0.9 * std::cos(std::numbers::pi * t_s); }
Pose T_room_base(double t_s) {
  return MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(0.6 * t_s, Eigen::Vector3d::UnitZ())),
                  Eigen::Vector3d(0.5 * t_s - 1.5, 0.2 * t_s, 0.0));
}
Pose T_plate(double t_s) {
  return Pose(Eigen::Translation3d(0.3, 0, 0.8) *
              Eigen::AngleAxisd(TiltAt(t_s), Eigen::Vector3d::UnitY()));
}
Pose T_base_laser(double t_s) { return T_plate(t_s) * Pose(Eigen::Translation3d(0.05, 0, 0.1)); }

// The room: |x| <= 5, |y| <= 4, 0 <= z <= 3.
double RangeIn(const Eigen::Vector3d& from, const Eigen::Vector3d& along) {
  const Eigen::Vector3d low(-5, -4, 0), high(5, 4, 3);
  double range = 1e9;
  for (int k = 0; k < 3; ++k) {
    if (along[k] == 0.0) continue;
    range = std::min(range, ((along[k] > 0.0 ? high[k] : low[k]) - from[k]) / along[k]);
  }
  return range;
}
double FromWalls(const Eigen::Vector3d& p) {
  return std::min({std::abs(std::abs(p.x()) - 5),
                   std::abs(std::abs(p.y()) - 4),
                   std::abs(p.z()),
                   std::abs(p.z() - 3)});
}

std::int64_t StampOf(double t_s) { return kStartNs + std::llround(1e9 * t_s); }

class LaserSweepsTest : public ::testing::Test {
 protected:
  // Lines at 40 Hz, joints at 100 Hz, odometry at 50 Hz.
  static std::vector<BagEntry> Drive(bool joints, bool transforms) {
    std::vector<BagEntry> entries;
    const auto add = [&](const char* topic, const char* type, double t_s, std::string bytes) {
      entries.push_back({topic, type, StampOf(t_s), std::move(bytes)});
    };
    for (int i = 0; i <= 100 * kDriveS + 20; ++i) {
      const double t_s = 0.01 * i;
      const std::int64_t stamp = StampOf(t_s);
      if (joints) {
        add("/joint_states",
            "sensor_msgs/msg/JointState",
            t_s,
            testing::JointMessage(Layout::kCdr, stamp, {{"tilt", TiltAt(t_s)}, {"wheel", t_s}}));
      }
      if (transforms) {
        add("/tf",
            "tf2_msgs/msg/TFMessage",
            t_s,
            testing::TransformMessage(Layout::kCdr, stamp, "base", "plate", T_plate(t_s)));
      }
      if (i % 2 == 0) {
        add("/odom",
            "nav_msgs/msg/Odometry",
            t_s,
            testing::OdometryMessage(Layout::kCdr, stamp, "odom", "base", T_room_base(t_s)));
      }
    }
    add("/tf_static",
        "tf2_msgs/msg/TFMessage",
        0,
        testing::TransformMessage(
            Layout::kCdr, 0, "plate", "laser", Pose(Eigen::Translation3d(0.05, 0, 0.1))));
    for (int line = 0; line < 40 * kDriveS; ++line) {
      const double t_s = line / 40.0;
      std::vector<float> ranges;
      for (int beam = 0; beam < kBeams; ++beam) {
        const double at_s = t_s + beam * kStepS;
        const double angle = -1.5 + beam * 3.0 / (kBeams - 1);
        const Pose T = T_room_base(at_s) * T_base_laser(at_s);
        ranges.push_back(static_cast<float>(RangeIn(
            T.translation(), T.linear() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0))));
      }
      add("/scan",
          "sensor_msgs/msg/LaserScan",
          t_s,
          testing::LaserMessage(Layout::kCdr,
                                StampOf(t_s),
                                "laser",
                                -1.5F,
                                static_cast<float>(3.0 / (kBeams - 1)),
                                static_cast<float>(kStepS),
                                ranges));
    }
    return entries;
  }

  std::string Write(const std::string& name, const std::string& bytes) const {
    STRATA_EXPECT_OK(WriteFileBytes(dir_.path() / name, bytes));
    return (dir_.path() / name).string();
  }
  absl::StatusOr<std::vector<ScanFile>> List(const std::vector<BagEntry>& entries,
                                             BagScanOptions options) {
    options.every.distance_m = 0.0;
    told_.clear();
    options.tell = [this](const std::string& line) { told_.push_back(line); };
    return ListBagScans({Write("a.mcap", testing::McapBytes(entries, {.compression = "zstd"}))},
                        options);
  }
  testing::TempDir dir_;
  std::vector<std::string> told_;
};

TEST_F(LaserSweepsTest, PointsLieOnTheWallsOfTheRoom) {
  STRATA_ASSERT_OK_AND_ASSIGN(
      const auto scans,
      List(Drive(true, false), {.urdf = Write("r.urdf", kRobot), .sweep_s = 1.0}));
  // The last half of a sweep is none.
  ASSERT_EQ(scans.size(), 6U);
  EXPECT_THAT(told_, Contains("6 of 6 sweeps of /scan with poses from /odom"));
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const double middle_s = static_cast<double>(i) + 0.5;
    EXPECT_EQ(scans[i].sequence, i);
    EXPECT_EQ(scans[i].time, absl::FromUnixNanos(StampOf(middle_s)));
    EXPECT_TRUE(scans[i].T_map_scan.isApprox(T_room_base(middle_s), 1e-9));
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScanFile(scans[i]));
    ASSERT_EQ(cloud.size(), 40U * kBeams);
    double worst_m = 0.0, lowest_m = 9.0, highest_m = -9.0;
    for (const Eigen::Vector3f& p : cloud.points) {
      const Eigen::Vector3d p_room = scans[i].T_map_scan * p.cast<double>();
      worst_m = std::max(worst_m, FromWalls(p_room));
      lowest_m = std::min(lowest_m, p_room.z());
      highest_m = std::max(highest_m, p_room.z());
    }
    // 2 mm are what joints 10 ms apart leave of a swing, 5 m away.
    EXPECT_LT(worst_m, 0.002) << "sweep " << i;
    EXPECT_LT(lowest_m, 0.01);
    EXPECT_GT(highest_m, 2.99);
    EXPECT_NEAR(cloud.sensor_origin.z(), 0.87, 0.05);
  }
}

TEST_F(LaserSweepsTest, TransformsSayTheSame) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, List(Drive(false, true), {}));
  ASSERT_EQ(scans.size(), 3U);
  STRATA_ASSERT_OK_AND_ASSIGN(const auto by_joints,
                              List(Drive(true, false), {.urdf = Write("r.urdf", kRobot)}));
  ASSERT_EQ(by_joints.size(), 3U);
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScanFile(scans[1]));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud other, ReadScanFile(by_joints[1]));
  ASSERT_EQ(cloud.size(), other.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_LT((cloud.points[i] - other.points[i]).norm(), 1e-4F);
  }
}

TEST_F(LaserSweepsTest, WhatIsMissingIsNamed) {
  const std::string urdf = Write("r.urdf", kRobot);
  EXPECT_THAT(List(Drive(false, false), {.urdf = urdf}),
              StatusIs(absl::StatusCode::kNotFound,
                       AllOf(HasSubstr("no sweep of /scan has a pose from /odom"),
                             HasSubstr("no sensor_msgs/JointState has a position of tilt"))));
  EXPECT_THAT(List(Drive(true, false), {}),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("the clouds are in frame laser")));
  EXPECT_EQ(List(Drive(true, false), {.urdf = dir_.path() / "b.urdf"}).status().code(),
            absl::StatusCode::kNotFound);
}

TEST_F(LaserSweepsTest, WhoHasCloudsMeansThem) {
  std::vector<BagEntry> entries = Drive(false, true);
  entries.push_back({"/points",
                     "sensor_msgs/msg/PointCloud2",
                     StampOf(1.0),
                     testing::CloudMessage(Layout::kCdr, StampOf(1.0), "base", {{1, 2, 3, 4}})});
  STRATA_ASSERT_OK_AND_ASSIGN(const auto clouds, List(entries, {}));
  EXPECT_EQ(clouds.size(), 1U);
  EXPECT_THAT(List(entries, {.sweep_s = 1.0}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("/points has clouds")));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto sweeps, List(entries, {.topic = "/scan"}));
  EXPECT_EQ(sweeps.size(), 3U);
}

}  // namespace
}  // namespace strata
