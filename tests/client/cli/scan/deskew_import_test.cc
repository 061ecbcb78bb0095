// `strata scan import` of a scanner that turns while its robot drives: recordings and files whose
// points have times.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/formats/file_bytes.h"
#include "client/formats/motion/trajectory_file.h"
#include "client/formats/scan_reader.h"
#include "tests/client/cli/run_strata.h"
#include "tests/support/bag_writer.h"
#include "tests/support/spun_scan.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using nlohmann::json;
using ::strata::testing::BagEntry;
using ::strata::testing::Layout;
using ::strata::testing::Spin;
using ::strata::testing::SpinnerPose;
using ::strata::testing::SpunScan;
using ::testing::HasSubstr;

constexpr std::int64_t kStartNs = 1'700'000'000'000'000'000;
constexpr double kPoseHz = 50.0;
constexpr double kScansAt[] = {1.0, 1.4, 1.8};
constexpr double kEndS = 2.0;

std::int64_t Nanoseconds(double time_s) {
  return kStartNs + static_cast<std::int64_t>(std::llround(1e9 * time_s));
}

std::string BagOfDrive(const std::string& frame) {
  std::vector<BagEntry> entries;
  for (int i = 0; i <= static_cast<int>(kEndS * kPoseHz); ++i) {
    const std::int64_t t = Nanoseconds(i / kPoseHz);
    entries.push_back(
        {"/odom",
         "nav_msgs/msg/Odometry",
         t,
         testing::OdometryMessage(Layout::kCdr, t, "odom", "lidar", SpinnerPose(i / kPoseHz))});
  }
  for (const double at_s : kScansAt) {
    const SpunScan scan = Spin(at_s, 0.0);
    std::vector<Eigen::Vector4f> points;
    std::vector<std::uint32_t> t_ns;
    for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
      const Eigen::Vector3f& p = scan.cloud.points[i];
      points.emplace_back(p.x(), p.y(), p.z(), 1.0F);
      t_ns.push_back(static_cast<std::uint32_t>(std::lround(1e9 * scan.offset_s[i])));
    }
    const std::int64_t t = Nanoseconds(at_s);
    entries.push_back({"/points",
                       "sensor_msgs/msg/PointCloud2",
                       t,
                       testing::CloudMessage(Layout::kCdr, t, frame, points, 1, t_ns)});
  }
  return testing::McapBytes(entries);
}

// As Hesai's driver has it: time since 1970 in seconds.
std::string PcdOf(const SpunScan& scan, double stamp_s) {
  const std::size_t count = scan.cloud.size();
  std::string pcd =
      absl::StrCat("VERSION 0.7\nFIELDS x y z timestamp\nSIZE 4 4 4 8\nTYPE F F F F\n",
                   "COUNT 1 1 1 1\nWIDTH ",
                   count,
                   "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS ",
                   count,
                   "\nDATA binary\n");
  for (std::size_t i = 0; i < count; ++i) {
    char record[20];
    const double time = stamp_s + scan.offset_s[i];
    std::memcpy(record, scan.cloud.points[i].data(), 12);
    std::memcpy(record + 12, &time, 8);
    pcd.append(record, sizeof(record));
  }
  return pcd;
}

class DeskewImportTest : public ::testing::Test {
 protected:
  std::string Path(const std::string& name) const { return (dir_.path() / name).string(); }
  Ran Run(std::vector<std::string> words) const {
    words.insert(words.end(), {"--embedded", Path("db"), "--output", "json"});
    return RunStrata(words);
  }
  // Into a map of its own.
  Ran Import(const std::string& map, const std::vector<std::string>& words) const {
    EXPECT_EQ(Run({"map", "create", map, "--cell-size", "1"}).exit_code, 0);
    std::vector<std::string> all = {"scan", "import", map};
    all.insert(all.end(), words.begin(), words.end());
    all.insert(all.end(), {"--trajectory", "t", "--align", "off", "--wait"});
    return Run(all);
  }
  // Of all scans of the map.
  double WorstError(const std::string& map) const {
    double worst = 0.0;
    std::size_t k = 0;
    for (const json& scan : json::parse(Run({"scan", "list", map}).out)) {
      const std::string id = scan.at("id");
      EXPECT_EQ(Run({"scan", "export", map, id, "--out", Path("scan.pcd")}).exit_code, 0);
      const auto cloud = ReadScan(Path("scan.pcd"));
      EXPECT_TRUE(cloud.ok()) << cloud.status();
      if (cloud.ok()) worst = std::max(worst, Spin(kScansAt[k], 0.0).WorstError(*cloud));
      ++k;
    }
    EXPECT_EQ(k, std::size(kScansAt));
    return worst;
  }
  testing::TempDir dir_;
};

TEST_F(DeskewImportTest, OfARecording) {
  STRATA_ASSERT_OK(WriteFileBytes(Path("drive.mcap"), BagOfDrive("lidar")));
  const Ran on = Import("on", {Path("drive.mcap"), "--every", "0m"});
  ASSERT_EQ(on.exit_code, 0) << on.err;
  EXPECT_EQ(json::parse(on.out).at("deskewed"), 3);
  EXPECT_EQ(json::parse(on.out).at("not_deskewed"), 0);
  EXPECT_LT(WorstError("on"), 5e-3);
  const Ran off = Import("off", {Path("drive.mcap"), "--every", "0m", "--deskew", "off"});
  ASSERT_EQ(off.exit_code, 0) << off.err;
  EXPECT_EQ(json::parse(off.out).at("deskewed"), 0);
  EXPECT_GT(WorstError("off"), 0.3);
}

// In the frame of an odometry, points have been put where they belong.
TEST_F(DeskewImportTest, NotOfWhatAnOdometryHasMoved) {
  STRATA_ASSERT_OK(WriteFileBytes(Path("drive.mcap"), BagOfDrive("odom")));
  const Ran ran = Import("m", {Path("drive.mcap"), "--every", "0m"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_EQ(json::parse(ran.out).at("deskewed"), 0);
  EXPECT_THAT(ran.err, HasSubstr("the points have times, which are not used"));
}

TEST_F(DeskewImportTest, OfFilesOnATrajectory) {
  std::vector<TrajectoryPose> poses;
  const double start_s = 1e-9 * static_cast<double>(kStartNs);
  for (int i = 0; i <= static_cast<int>(kEndS * kPoseHz); ++i) {
    TrajectoryPose& pose = poses.emplace_back();
    pose.time_s = start_s + i / kPoseHz;
    pose.T_map_body = SpinnerPose(i / kPoseHz);
    pose.covariance = 1e-4 * Matrix6d::Identity();
  }
  STRATA_ASSERT_OK_AND_ASSIGN(Trajectory way, Trajectory::Make(poses));
  STRATA_ASSERT_OK(WriteFileBytes(Path("run.csv"), TrajectoryText({way, {}})));
  std::filesystem::create_directory(Path("scans"));
  for (const double at_s : kScansAt) {
    const std::string name = absl::StrFormat("scans/%.6f.pcd", start_s + at_s);
    STRATA_ASSERT_OK(WriteFileBytes(Path(name), PcdOf(Spin(at_s, 0.0), start_s + at_s)));
  }
  const Ran ran = Import("m", {Path("scans"), "--poses", Path("run.csv")});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_EQ(json::parse(ran.out).at("deskewed"), 3);
  EXPECT_LT(WorstError("m"), 5e-3);
  // A trajectory that ends in the middle of the last scan.
  poses.resize(static_cast<std::size_t>(1.86 * kPoseHz));
  STRATA_ASSERT_OK_AND_ASSIGN(Trajectory shorter, Trajectory::Make(poses));
  STRATA_ASSERT_OK(WriteFileBytes(Path("run.csv"), TrajectoryText({shorter, {}})));
  const Ran warned = Import("w", {Path("scans"), "--poses", Path("run.csv")});
  ASSERT_EQ(warned.exit_code, 0) << warned.err;
  EXPECT_EQ(json::parse(warned.out).at("not_deskewed"), 1);
  EXPECT_THAT(warned.err, HasSubstr("1 scan(s) keep the distortion of their motion; the first: "));
}

}  // namespace
}  // namespace strata::cli
