// From messages to scans with poses: topics, frames, times, keyframes.
#include "client/formats/bags/bag_scans.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/bags/pose_track.h"
#include "client/formats/bags/recording.h"
#include "client/formats/bags/transform_tree.h"
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
constexpr std::int64_t kStepNs = 100'000'000;

Pose Yaw(double angle_rad, double x, double y) {
  return MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitZ())),
                  Eigen::Vector3d(x, y, 0.5));
}

TEST(KeyframeSpacingTest, DistancesAnglesAndTimes) {
  STRATA_ASSERT_OK_AND_ASSIGN(const KeyframeSpacing all, ParseKeyframeSpacing("0.5m,90deg,2s"));
  EXPECT_EQ(all.distance_m, 0.5);
  EXPECT_DOUBLE_EQ(*all.angle_rad, std::numbers::pi / 2.0);
  EXPECT_EQ(all.time_s, 2.0);
  STRATA_ASSERT_OK_AND_ASSIGN(const KeyframeSpacing turn, ParseKeyframeSpacing("0.3rad"));
  EXPECT_EQ(turn.angle_rad, 0.3);
  EXPECT_FALSE(turn.distance_m.has_value());
  for (const char* bad : {"", "5", "0.5m,", "-1m", "nanm", "1km", "m"}) {
    EXPECT_THAT(ParseKeyframeSpacing(bad),
                StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("0.5m, 20deg, 2s")))
        << bad;
  }
}

TEST(KeyframeChooserTest, KeepsWhatIsFarTurnedOrLate) {
  KeyframeChooser chooser({.distance_m = 1.0, .angle_rad = 0.5, .time_s = 10.0});
  EXPECT_TRUE(chooser.Keep(0.0, Yaw(0, 0, 0)));
  EXPECT_FALSE(chooser.Keep(1.0, Yaw(0.4, 0.9, 0)));
  EXPECT_TRUE(chooser.Keep(2.0, Yaw(0.4, 1.0, 0)));
  EXPECT_TRUE(chooser.Keep(3.0, Yaw(0.9, 1.0, 0)));
  EXPECT_FALSE(chooser.Keep(12.9, Yaw(0.9, 1.0, 0)));
  EXPECT_TRUE(chooser.Keep(13.0, Yaw(0.9, 1.0, 0)));
}

TEST(PoseTrackTest, ExactStampsAndBetweenThem) {
  PoseTrack track;
  const double h = std::sqrt(0.5);
  STRATA_EXPECT_OK(track.Add(1'000'000'000, {2, 0, 0}, {0, 0, h, h}));  // a quarter turn
  STRATA_EXPECT_OK(track.Add(500'000'000, {1, 0, 0}, {0, 0, 0, 1}));
  STRATA_EXPECT_OK(track.Add(9'000'000'000, {3, 0, 0}, {0, 0, 0, 1}));
  STRATA_ASSERT_OK_AND_ASSIGN(const Pose at, track.At(500'000'000));
  EXPECT_EQ(at.translation(), Eigen::Vector3d(1, 0, 0));
  STRATA_ASSERT_OK_AND_ASSIGN(const Pose between, track.At(600'000'000));
  EXPECT_NEAR(between.translation().x(), 1.2, 1e-12);
  EXPECT_NEAR(RotationAngleRad(between), 0.2 * std::numbers::pi / 2.0, 1e-12);
  EXPECT_THAT(
      track.At(499'999'999),
      StatusIs(absl::StatusCode::kNotFound, HasSubstr("outside of the poses' 0.500 to 9.000")));
  EXPECT_THAT(track.At(9'000'000'001), StatusIs(absl::StatusCode::kNotFound, HasSubstr("outside")));
  EXPECT_THAT(track.At(5'000'000'000),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("gap of 8.000 s")));
  EXPECT_EQ(track.Add(0, {std::nan(""), 0, 0}, {0, 0, 0, 1}).code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(track.Add(0, {0, 0, 0}, {0, 0, 0, 0}).code(), absl::StatusCode::kInvalidArgument);
}

RosPose Transform(std::int64_t stamp_ns,
                  const std::string& parent,
                  const std::string& child,
                  const Pose& T) {
  const Eigen::Quaterniond q(T.linear());
  const Eigen::Vector3d p = T.translation();
  return {{stamp_ns, parent}, child, {p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

TEST(TransformTreeTest, UpAndDownTheTree) {
  TransformTree tree;
  const Pose T_map_odom = Yaw(0.3, 5, 6);
  const Pose T_odom_base = Yaw(-1.0, 1, 2);
  const Pose T_base_lidar = Yaw(2.0, 0.1, 0.2);
  const Pose T_base_camera = Yaw(-0.5, 0.3, 0);
  STRATA_EXPECT_OK(tree.Add(Transform(100, "map", "odom", T_map_odom), false));
  STRATA_EXPECT_OK(tree.Add(Transform(100, "odom", "base", T_odom_base), false));
  STRATA_EXPECT_OK(tree.Add(Transform(7, "base", "lidar", T_base_lidar), true));
  STRATA_EXPECT_OK(tree.Add(Transform(7, "base", "camera", T_base_camera), true));
  STRATA_ASSERT_OK_AND_ASSIGN(const Pose down, tree.Lookup("map", "lidar", 100));
  EXPECT_TRUE(down.isApprox(T_map_odom * T_odom_base * T_base_lidar, 1e-12));
  STRATA_ASSERT_OK_AND_ASSIGN(const Pose across, tree.Lookup("camera", "lidar", 123456));
  EXPECT_TRUE(across.isApprox(T_base_camera.inverse() * T_base_lidar, 1e-12));
  STRATA_ASSERT_OK_AND_ASSIGN(const Pose up, tree.Lookup("lidar", "map", 100));
  EXPECT_TRUE(up.isApprox((T_map_odom * T_odom_base * T_base_lidar).inverse(), 1e-12));
  STRATA_ASSERT_OK_AND_ASSIGN(const Pose self, tree.Lookup("base", "base", 100));
  EXPECT_TRUE(self.isApprox(Pose::Identity()));
  EXPECT_TRUE(tree.HangsFrom("lidar", "map"));
  EXPECT_FALSE(tree.HangsFrom("map", "lidar"));
  EXPECT_THAT(tree.Lookup("map", "lidar", 101),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("from odom to base")));
  EXPECT_THAT(tree.Lookup("map", "gps", 100),
              StatusIs(absl::StatusCode::kNotFound,
                       HasSubstr("there are frames base, camera, lidar, map, odom")));
  EXPECT_THAT(tree.Add(Transform(1, "rig", "lidar", Yaw(0, 0, 0)), false),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("two parents")));
}

TEST(TransformTreeTest, ARingEnds) {
  TransformTree tree;
  STRATA_EXPECT_OK(tree.Add(Transform(0, "a", "b", Yaw(0, 1, 0)), true));
  STRATA_EXPECT_OK(tree.Add(Transform(0, "b", "a", Yaw(0, 1, 0)), true));
  EXPECT_EQ(tree.Lookup("a", "c", 0).status().code(), absl::StatusCode::kNotFound);
  STRATA_EXPECT_OK(tree.Lookup("a", "b", 0));
}

class BagScansTest : public ::testing::Test {
 protected:
  // A robot that drives along x at 1 m/s; clouds at 10 Hz in `cloud_frame`, odometry at 20 Hz, from
  // half a second before the first cloud until the last one.
  static std::vector<BagEntry> Drive(const std::string& cloud_frame, bool poses, bool transforms) {
    std::vector<BagEntry> entries;
    const auto add = [&entries](
                         const char* topic, const char* type, std::int64_t t, std::string m) {
      entries.push_back({topic, type, t + 5'000'000, std::move(m)});
    };
    add("/tf_static",
        "tf2_msgs/msg/TFMessage",
        kStartNs,
        testing::TransformMessage(Layout::kCdr, 0, "base", "lidar", Yaw(0.5, 0.2, 0)));
    for (int i = -10; i <= 2 * 49; ++i) {
      const std::int64_t t = kStartNs + i * kStepNs / 2;
      const Pose T_odom_base = Yaw(0, 0.05 * i, 0);
      if (poses) {
        add("/odom",
            "nav_msgs/msg/Odometry",
            t,
            testing::OdometryMessage(Layout::kCdr, t, "odom", "base", T_odom_base));
      }
      if (transforms) {
        add("/tf",
            "tf2_msgs/msg/TFMessage",
            t,
            testing::TransformMessage(Layout::kCdr, t, "odom", "base", T_odom_base));
        add("/tf",
            "tf2_msgs/msg/TFMessage",
            t,
            testing::TransformMessage(Layout::kCdr, t, "map", "odom", Yaw(0, 100, 0)));
      }
      if (i < 0 || i % 2 != 0) continue;
      const auto x = static_cast<float>(i);
      add("/points",
          "sensor_msgs/msg/PointCloud2",
          t,
          testing::CloudMessage(Layout::kCdr, t, cloud_frame, {{x, 1, 2, 3}, {x, 2, 3, 4}}));
    }
    return entries;
  }
  std::filesystem::path Write(const std::vector<BagEntry>& entries,
                              const std::string& name = "drive.mcap") const {
    STRATA_EXPECT_OK(
        WriteFileBytes(dir_.path() / name,
                       testing::McapBytes(entries, {.compression = "lz4", .chunk_bytes = 3000})));
    return dir_.path() / name;
  }
  absl::StatusOr<std::vector<ScanFile>> List(const std::filesystem::path& path,
                                             BagScanOptions options) {
    if (!options.every.distance_m.has_value()) options.every.distance_m = 0.5;
    told_.clear();
    options.tell = [this](const std::string& line) { told_.push_back(line); };
    return ListBagScans({path}, options);
  }
  testing::TempDir dir_;
  std::vector<std::string> told_;
};

TEST_F(BagScansTest, TheOnlyTopicsAreTaken) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, List(Write(Drive("lidar", true, false)), {}));
  ASSERT_EQ(scans.size(), 10U);
  for (std::size_t i = 0; i < scans.size(); ++i) {
    EXPECT_EQ(scans[i].sequence, 5 * i);
    EXPECT_EQ(scans[i].time,
              absl::FromUnixNanos(kStartNs + 5 * kStepNs * static_cast<std::int64_t>(i)));
    EXPECT_TRUE(scans[i].T_map_scan.isApprox(
        Yaw(0, 0.5 * static_cast<double>(i), 0) * Yaw(0.5, 0.2, 0), 1e-12));
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScanFile(scans[i]));
    ASSERT_EQ(cloud.size(), 2U);
    EXPECT_EQ(cloud.points[0], Eigen::Vector3f(static_cast<float>(10 * i), 1, 2));
  }
  EXPECT_THAT(told_, Contains("10 of 50 clouds of /points with poses from /odom"));
}

TEST_F(BagScansTest, TransformsGivePosesToo) {
  const auto path = Write(Drive("lidar", false, true));
  for (const char* spec : {"tf:map→base", "tf:map->base"}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, List(path, {.poses_from = spec}));
    ASSERT_EQ(scans.size(), 10U);
    EXPECT_TRUE(scans[2].T_map_scan.isApprox(
        Yaw(0, 101, 0).translate(Eigen::Vector3d(0, 0, 0.5)) * Yaw(0.5, 0.2, 0), 1e-12));
  }
  EXPECT_THAT(List(path, {}),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       AllOf(HasSubstr("--poses-from tf:FIXED->BASE"),
                             HasSubstr("base, lidar, map, odom"))));
}

TEST_F(BagScansTest, CloudsOfTheFixedFrameAreMovedToTheBase) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, List(Write(Drive("odom", true, false)), {}));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScanFile(scans.at(3)));
  EXPECT_EQ(scans[3].T_map_scan.translation(), Eigen::Vector3d(1.5, 0, 0.5));
  EXPECT_TRUE(cloud.points[0].isApprox(Eigen::Vector3f(28.5F, 1, 1.5F)));
}

TEST_F(BagScansTest, FramesThatNothingConnectsNeedAMount) {
  const auto path = Write(Drive("scanner", true, false));
  EXPECT_THAT(List(path, {}),
              StatusIs(absl::StatusCode::kNotFound,
                       AllOf(HasSubstr("frame scanner"), HasSubstr("--mount"))));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, List(path, {.T_base_cloud = Yaw(0, 0, 1)}));
  EXPECT_TRUE(scans.at(1).T_map_scan.isApprox(Yaw(0, 0.5, 0) * Yaw(0, 0, 1)));
}

TEST_F(BagScansTest, TopicsThatAreUnclearAreListed) {
  std::vector<BagEntry> entries = Drive("lidar", true, false);
  const std::size_t once = entries.size();
  for (std::size_t i = 0; i < once; ++i) {
    entries.push_back(entries[i]);
    entries.back().topic += "2";
  }
  const auto path = Write(entries);
  EXPECT_THAT(List(path, {}),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       HasSubstr("which clouds? Say --topic /points (sensor_msgs/PointCloud2, 50 "
                                 "messages, 10 Hz) or --topic /points2 (")));
  EXPECT_THAT(List(path, {.topic = "/points"}),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       HasSubstr("which poses? Say --poses-from /odom (nav_msgs/Odometry, 109 "
                                 "messages, 20 Hz) or --poses-from /odom2")));
  EXPECT_THAT(List(path, {.topic = "/odom"}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("no topic /odom has clouds")));
  EXPECT_THAT(
      List(path, {.topic = "points", .poses_from = "/points"}),
      StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("'/points' is no topic of poses")));
  STRATA_EXPECT_OK(List(path, {.topic = "points", .poses_from = "odom2"}));
  EXPECT_THAT(List(Write({{"/a", "std_msgs/msg/String", 1, "x"}}, "b.mcap"), {}),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("strata scan topics")));
}

TEST_F(BagScansTest, CloudsWithoutAPoseAreLeftOutAndTold) {
  std::vector<BagEntry> entries = Drive("lidar", true, false);
  for (BagEntry& entry : entries) {
    // The first 20 clouds come before any pose.
    if (entry.topic == "/odom" && entry.time_ns < kStartNs + 20 * kStepNs) entry.topic = "/other";
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, List(Write(entries), {.poses_from = "/odom"}));
  EXPECT_EQ(scans.front().sequence, 20U);
  EXPECT_THAT(told_, Contains(HasSubstr("warning: 20 clouds have no pose and are left out: time")));
}

TEST_F(BagScansTest, MessagesThatArePackedOneByOneAreUnpacked) {
  std::vector<BagEntry> entries = Drive("lidar", true, false);
  for (BagEntry& entry : entries) entry.bytes = testing::Packed("zstd", entry.bytes);
  ASSERT_TRUE(testing::WriteDb3(dir_.path() / "a.db3", entries));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, List(dir_.path() / "a.db3", {}));
  ASSERT_EQ(scans.size(), 10U);
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScanFile(scans[4]));
  EXPECT_EQ(cloud.points[1], Eigen::Vector3f(40, 2, 3));
}

TEST_F(BagScansTest, AFolderIsOneRecordingIfItSaysSo) {
  const std::vector<BagEntry> all = Drive("lidar", true, false);
  const std::filesystem::path folder = dir_.path() / "bag";
  std::filesystem::create_directories(folder);
  Write({all.begin(), all.begin() + 80}, "bag/a_0.mcap");
  Write({all.begin() + 80, all.end()}, "bag/a_1.mcap");
  EXPECT_TRUE(IsRecording(folder));
  EXPECT_THAT(
      List(folder, {}),
      StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("2 bags and no metadata.yaml")));
  STRATA_EXPECT_OK(WriteFileBytes(folder / "metadata.yaml", "rosbag2_bagfile_information:\n"));
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, List(folder, {}));
  EXPECT_EQ(scans.size(), 10U);
  for (const ScanFile& scan : scans) STRATA_EXPECT_OK(ReadScanFile(scan));
  STRATA_EXPECT_OK(WriteFileBytes(folder / "a_2.mcap.zstd", "x"));
  EXPECT_THAT(List(folder, {}), StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("zstd -d")));
}

}  // namespace
}  // namespace strata
