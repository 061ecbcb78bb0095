#include "client/formats/motion/placed_scans.h"

#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "absl/time/time.h"
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/file_bytes.h"
#include "client/formats/motion/trajectory_file.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::testing::HasSubstr;
using testing::StatusIs;

class PlacedScansTest : public ::testing::Test {
 protected:
  PlacedScansTest() {
    std::vector<TrajectoryPose> poses(3);
    for (int i = 0; i < 3; ++i) {
      poses[i].time_s = 1000.0 + 0.5 * i;
      poses[i].T_map_body.translation() = Eigen::Vector3d(2.0 * i, 0.0, 0.0);
    }
    auto trajectory = Trajectory::Make(std::move(poses));
    STRATA_EXPECT_OK(trajectory.status());
    STRATA_EXPECT_OK(WriteFileBytes(file_, TrajectoryText({*std::move(trajectory), std::nullopt})));
  }
  static ScanFile Named(const char* name) {
    ScanFile scan;
    scan.path = name;
    return scan;
  }
  testing::TempDir dir_;
  const std::filesystem::path file_ = dir_.path() / "run.csv";
};

TEST_F(PlacedScansTest, ByTheTimesThatTheirNamesAre) {
  EXPECT_TRUE(IsTrajectory(file_));
  std::vector<ScanFile> scans = {Named("scans/1000.250000.pcd"), Named("scans/2000.000000.pcd")};
  const Pose T_body_scan(Eigen::Translation3d(0.0, 0.0, 1.5));
  STRATA_ASSERT_OK(PlaceOnTrajectory(file_, T_body_scan, scans));
  STRATA_EXPECT_OK(scans[0].pose_status);
  EXPECT_LT((scans[0].T_map_scan.translation() - Eigen::Vector3d(1.0, 0.0, 1.5)).norm(), 1e-9);
  EXPECT_EQ(scans[0].time, absl::FromUnixMillis(1000250));
  EXPECT_THAT(scans[1].pose_status,
              StatusIs(absl::StatusCode::kOutOfRange, HasSubstr("outside the trajectory")));
}

// The covariance of the sensor's pose is that of draws of the body's.
TEST_F(PlacedScansTest, OnEarthWithTheCovarianceOfTheSensor) {
  const Pose T_body_scan =
      MakePose(Eigen::Quaterniond(0.8, 0.0, 0.6, 0.0), Eigen::Vector3d(0.7, -0.3, 1.5));
  TrajectoryPose pose;
  pose.time_s = 1000.0;
  pose.T_map_body =
      MakePose(Eigen::Quaterniond(0.6, 0.0, 0.0, 0.8), Eigen::Vector3d(5.0, 6.0, 7.0));
  const Vector6d sigma{{0.01, 0.02, 0.03, 0.5, 0.4, 0.8}};
  pose.covariance = sigma.cwiseAbs2().asDiagonal();
  ScanFile scan = Named("1000.000000.pcd");
  scan.time = absl::FromUnixSeconds(1000);
  std::vector<ScanFile> scans = {scan};
  STRATA_ASSERT_OK_AND_ASSIGN(Trajectory trajectory, Trajectory::Make({pose}));
  PlaceOn(trajectory, false, T_body_scan, scans);
  EXPECT_FALSE(scans[0].pose_covariance.has_value());
  PlaceOn(trajectory, true, T_body_scan, scans);
  ASSERT_TRUE(scans[0].pose_covariance.has_value());
  Matrix6d expected = Matrix6d::Zero();
  for (int k = 0; k < 6; ++k) {
    constexpr double kSmall = 1e-5;
    const Pose off = Retract(pose.T_map_body, kSmall * sigma(k) * Vector6d::Unit(k)) * T_body_scan;
    const Pose step = scans[0].T_map_scan.inverse() * off;
    Vector6d by;
    by << So3Log(step.linear()), step.translation();
    expected += by * by.transpose() / (kSmall * kSmall);
  }
  EXPECT_LT((*scans[0].pose_covariance - expected).norm(), 1e-4 * expected.norm());
}

TEST_F(PlacedScansTest, OtherNamesSayWhatToDo) {
  std::vector<ScanFile> scans = {Named("scans/scan0001.pcd")};
  EXPECT_THAT(PlaceOnTrajectory(file_, Pose::Identity(), scans),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("rename them")));
  STRATA_ASSERT_OK(WriteFileBytes(dir_.path() / "tum.txt", "1 0 0 0 0 0 0 1\n"));
  EXPECT_FALSE(IsTrajectory(dir_.path() / "tum.txt"));
  EXPECT_FALSE(IsTrajectory(dir_.path() / "none.csv"));
}

}  // namespace
}  // namespace strata
