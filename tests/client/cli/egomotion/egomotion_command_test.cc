// strata egomotion, as its users run it.
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/formats/file_bytes.h"
#include "client/formats/motion/trajectory_file.h"
#include "client/formats/pose_reader.h"
#include "tests/client/cli/run_strata.h"
#include "tests/support/simulator/simulated_drive.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;

class EgomotionCommandTest : public ::testing::Test {
 protected:
  EgomotionCommandTest() {
    options_.seconds = 60.0;
    options_.rig.R_body_imu = Eigen::Quaterniond::Identity();
    options_.rig.imu.gyro_noise = 1e-3;
    options_.rig.imu.accelerometer_noise = 0.02;
    testing::WriteDrive(testing::SimulateDrive(options_, 5), dir_.path());
  }
  std::string Path(const std::string& name) const { return (dir_.path() / name).string(); }
  testing::TempDir dir_;
  testing::DriveOptions options_;
};

TEST_F(EgomotionCommandTest, WritesTheWayAndAReport) {
  const Ran ran = RunStrata({"egomotion",
                             dir_.path().string(),
                             "--out",
                             Path("run.csv"),
                             "--report",
                             Path("run.json"),
                             "--output",
                             "json"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("--poses " + Path("run.csv")));
  STRATA_ASSERT_OK_AND_ASSIGN(const TrajectoryFile file, ReadTrajectory(Path("run.csv")));
  const json report = json::parse(ran.out);
  EXPECT_EQ(report["poses"], file.trajectory.poses().size());
  EXPECT_GT(report["fixes_used"], 110);
  EXPECT_EQ(report["stood_at_start"], true);
  STRATA_ASSERT_OK_AND_ASSIGN(const std::string written, ReadFileBytes(Path("run.json")));
  EXPECT_EQ(json::parse(written), report);
  ASSERT_TRUE(file.origin.has_value());
  STRATA_ASSERT_OK_AND_ASSIGN(const TrajectoryPose pose, file.trajectory.At(1050.0));
  const Pose truth = testing::TrueBodyPose(options_, 1050.0);
  const Eigen::Vector3d start = testing::TrueBodyPose(options_, 1000.0).translation();
  EXPECT_LT((pose.T_map_body.translation() - (truth.translation() - start)).norm(), 6.0);
}

// From the log to a map: scans named by their times stand where the robot was.
TEST_F(EgomotionCommandTest, ScansAreImportedOnIt) {
  ASSERT_EQ(RunStrata({"egomotion", dir_.path().string(), "--out", Path("run.csv")}).exit_code, 0);
  std::filesystem::create_directory(dir_.path() / "scans");
  std::string floor;
  for (int i = 0; i < 100; ++i) {
    floor += std::to_string(i % 10) + " " + std::to_string(i / 10) + " -1\n";
  }
  for (const char* time : {"1020.010000", "1040.020000"}) {
    STRATA_ASSERT_OK(WriteFileBytes(dir_.path() / "scans" / (std::string(time) + ".xyz"), floor));
  }
  const auto run = [this](std::vector<std::string> words) {
    words.insert(words.end(), {"--embedded", Path("db"), "--output", "json"});
    return RunStrata(words);
  };
  ASSERT_EQ(run({"map", "create", "m"}).exit_code, 0);
  const Ran imported = run({"scan",
                            "import",
                            "m",
                            Path("scans"),
                            "--poses",
                            Path("run.csv"),
                            "--sensor",
                            "0,0,1.5",
                            "--align",
                            "off",
                            "--wait"});
  ASSERT_EQ(imported.exit_code, 0) << imported.err;
  STRATA_ASSERT_OK_AND_ASSIGN(const TrajectoryFile file, ReadTrajectory(Path("run.csv")));
  STRATA_ASSERT_OK_AND_ASSIGN(const TrajectoryPose pose, file.trajectory.At(1040.02));
  const Eigen::Vector3d sensor = pose.T_map_body * Eigen::Vector3d(0.0, 0.0, 1.5);
  const Ran exported = run({"pose", "export", "m", "--out", Path("poses.txt")});
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  STRATA_ASSERT_OK_AND_ASSIGN(const PoseList poses, ReadPoses(Path("poses.txt")));
  ASSERT_EQ(poses.poses.size(), 2U);
  EXPECT_LT((poses.poses[1].T_map_scan.translation() - sensor).norm(), 1e-3);
  const Ran refused =
      run({"scan", "import", "m", Path("scans"), "--poses", "none", "--sensor", "0,0,1"});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("--sensor needs --poses with a trajectory"));
}

TEST_F(EgomotionCommandTest, TakesARigAndSmooths) {
  STRATA_ASSERT_OK(WriteFileBytes(Path("rig.yaml"), "imu: {orientation: [0, 0, 0]}\n"));
  const Ran ran = RunStrata({"egomotion",
                             dir_.path().string(),
                             "--out",
                             Path("run.csv"),
                             "--rig",
                             Path("rig.yaml"),
                             "--heading",
                             "53",
                             "--smooth"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_THAT(ran.out, AllOf(HasSubstr("fixes_rejected"), HasSubstr("gyro_bias_deg_s")));
}

TEST_F(EgomotionCommandTest, SaysWhatToDoNext) {
  const Ran nothing = RunStrata({"egomotion", Path("none"), "--out", Path("run.csv")});
  EXPECT_EQ(nothing.exit_code, 1);
  EXPECT_THAT(nothing.err, HasSubstr("is no folder; name the one that holds the log's files"));
  const Ran silent = RunStrata({"egomotion", dir_.path().string()});
  EXPECT_EQ(silent.exit_code, 2);
  EXPECT_THAT(silent.err, HasSubstr("--out is required"));
  const Ran help = RunStrata({"egomotion", "--help"});
  EXPECT_THAT(help.out, HasSubstr("strata egomotion drives/monday --out monday.csv"));
}

}  // namespace
}  // namespace strata::cli
