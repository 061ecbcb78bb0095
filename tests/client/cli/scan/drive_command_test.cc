// strata drive and map georeference, as their users run them.
#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "client/formats/file_bytes.h"
#include "client/formats/motion/trajectory_file.h"
#include "core/egomotion/geodesy.h"
#include "tests/client/cli/run_strata.h"
#include "tests/support/simulator/simulated_drive.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kDegrees = 180.0 / std::numbers::pi;

class DriveCommandTest : public ::testing::Test {
 protected:
  DriveCommandTest() {
    options_.seconds = 60.0;
    options_.rig.R_body_imu = Eigen::Quaterniond::Identity();
    options_.rig.imu.gyro_noise = 1e-3;
    options_.rig.imu.accelerometer_noise = 0.02;
    std::filesystem::create_directories(dir_.path() / "log" / "scans");
    testing::WriteDrive(testing::SimulateDrive(options_, 5), dir_.path() / "log");
    std::string floor;
    for (int i = 0; i < 900; ++i) {
      floor += absl::StrFormat("%.2f %.2f -1.5\n", 0.3 * (i % 30 - 15), 0.3 * (i / 30 - 15));
    }
    for (int i = 0; i < 57; ++i) {
      const std::string name = absl::StrFormat("log/scans/%.6f.xyz", 1000.5 + 1.01 * i);
      STRATA_EXPECT_OK(WriteFileBytes(dir_.path() / name, floor));
    }
  }
  std::string Path(const std::string& name) const { return (dir_.path() / name).string(); }
  Ran Run(std::vector<std::string> words) const {
    words.insert(words.end(), {"--embedded", Path("db"), "--output", "json"});
    return RunStrata(words);
  }
  // Where the scans of a trajectory are on earth, in the frame of the truth.
  std::vector<Eigen::Vector3d> TrueFramePlaces(const std::string& trajectory) const {
    EXPECT_EQ(Run({"pose",
                   "export",
                   "m",
                   "--format",
                   "csv",
                   "--trajectory",
                   trajectory,
                   "--out",
                   Path("poses.csv")})
                  .exit_code,
              0);
    std::ifstream file(Path("poses.csv"));
    std::string line;
    std::getline(file, line);
    EXPECT_EQ(line, "id,time,x,y,z,qx,qy,qz,qw,latitude,longitude,altitude");
    const LocalFrame frame(options_.origin);
    std::vector<Eigen::Vector3d> places;
    times_.clear();
    while (std::getline(file, line)) {
      std::vector<double> numbers;
      std::size_t at = line.find(',');
      while (at != std::string::npos) {
        numbers.push_back(std::stod(line.substr(at + 1)));
        at = line.find(',', at + 1);
      }
      times_.push_back(numbers.at(0));
      places.push_back(
          frame.ToMap({numbers.at(8) / kDegrees, numbers.at(9) / kDegrees, numbers.at(10)}));
    }
    return places;
  }
  double WorstHorizontalError(const std::string& trajectory) const {
    const std::vector<Eigen::Vector3d> places = TrueFramePlaces(trajectory);
    double worst = 0.0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Eigen::Vector3d truth = testing::TrueBodyPose(options_, times_[i]).translation();
      worst = std::max(worst, (places[i] - truth).head<2>().norm());
    }
    return worst;
  }
  testing::TempDir dir_;
  testing::DriveOptions options_;
  mutable std::vector<double> times_;
};

TEST_F(DriveCommandTest, ALogBecomesAMapOnEarth) {
  ASSERT_EQ(Run({"map", "create", "m"}).exit_code, 0);
  const std::vector<std::string> drive = {
      "drive", Path("log"), "m", "--every", "2m", "--align", "off", "--wait"};
  const Ran ran = Run(drive);
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_THAT(ran.err, AllOf(HasSubstr("of 60 s: "), HasSubstr("scans sent")));
  const json summary = json::parse(ran.out);
  EXPECT_EQ(summary.at("trajectory"), "log");
  EXPECT_GE(summary.at("uploaded"), 25);
  EXPECT_EQ(summary.at("integrated"), summary.at("uploaded"));
  EXPECT_GT(summary.at("fixes_used"), 110);
  EXPECT_NEAR(summary.at("drive_seconds").get<double>(), 60.0, 0.5);
  EXPECT_LT(WorstHorizontalError("log"), 4.0);
  EXPECT_EQ(times_.size(), summary.at("uploaded"));
  EXPECT_TRUE(std::is_sorted(times_.begin(), times_.end()));
  // Every ten seconds a pose counts by itself.
  const json constraints = json::parse(Run({"posegraph", "show", "m"}).out).at("constraints");
  std::size_t priors = 0;
  for (const json& constraint : constraints) {
    priors += constraint.at("may_be_false") == true ? 1 : 0;
  }
  EXPECT_EQ(priors, summary.at("gps_priors"));
  EXPECT_GE(priors, 4U);
  EXPECT_LE(priors, 7U);
  // Again sends nothing; as another drive it lands where the first one is.
  const json again = json::parse(Run(drive).out);
  EXPECT_EQ(again.at("uploaded"), 0);
  EXPECT_EQ(again.at("skipped"), summary.at("uploaded"));
  std::vector<std::string> other = drive;
  other.insert(other.end(), {"--trajectory", "other"});
  ASSERT_EQ(Run(other).exit_code, 0);
  EXPECT_LT(WorstHorizontalError("other"), 4.0);
}

TEST_F(DriveCommandTest, WhatIsMissingIsSaid) {
  ASSERT_EQ(Run({"map", "create", "m"}).exit_code, 0);
  EXPECT_THAT(Run({"drive", Path("log"), "m", "--scans", Path("nowhere")}).err,
              HasSubstr("say with --scans which folder"));
  ASSERT_EQ(Run({"scan", "import", "m", Path("log/scans/1000.500000.xyz")}).exit_code, 0);
  EXPECT_THAT(Run({"drive", Path("log"), "m"}).err,
              HasSubstr("has scans and is nowhere on earth; say where with map georeference"));
}

// A map made at the run's poses, but from another place on, is found on earth.
TEST_F(DriveCommandTest, AMapIsPutOnEarthByItsDrive) {
  ASSERT_EQ(RunStrata({"egomotion", Path("log"), "--out", Path("run.csv")}).exit_code, 0);
  ASSERT_EQ(Run({"map", "create", "m", "--cell-size", "0.5"}).exit_code, 0);
  STRATA_ASSERT_OK_AND_ASSIGN(const TrajectoryFile run, ReadTrajectory(Path("run.csv")));
  std::string tum;
  std::size_t scans = 0;
  for (int i = 0; i < 57; ++i) {
    const double time = 1000.5 + 1.01 * i;
    STRATA_ASSERT_OK_AND_ASSIGN(const TrajectoryPose pose, run.trajectory.At(time));
    const Eigen::Vector3d p = pose.T_map_body.translation() + Eigen::Vector3d(40.0, -7.0, 2.0);
    tum += absl::StrFormat("%.6f %.4f %.4f %.4f 0 0 0 1\n", time, p.x(), p.y(), p.z());
    ++scans;
  }
  STRATA_ASSERT_OK(WriteFileBytes(Path("poses.txt"), tum));
  ASSERT_EQ(Run({"scan",
                 "import",
                 "m",
                 Path("log/scans"),
                 "--poses",
                 Path("poses.txt"),
                 "--align",
                 "off",
                 "--trajectory",
                 "log",
                 "--wait"})
                .exit_code,
            0);
  const Ran nowhere = Run({"surface", "m", "--at", "40,-7"});
  EXPECT_FALSE(json::parse(nowhere.out).at("surfaces").at(0).contains("latitude"));
  const Ran ran = Run({"map", "georeference", "m", Path("run.csv")});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const json fit = json::parse(ran.out);
  EXPECT_EQ(fit.at("scans"), scans);
  EXPECT_LT(fit.at("rms_m"), 0.01);
  EXPECT_LT(WorstHorizontalError("log"), 4.0);
  const json surface = json::parse(Run({"surface", "m", "--at", "40,-7"}).out).at("surfaces").at(0);
  const Eigen::Vector3d at = LocalFrame(*run.origin)
                                 .ToMap({surface.at("latitude").get<double>() / kDegrees,
                                         surface.at("longitude").get<double>() / kDegrees,
                                         surface.at("altitude").get<double>()});
  EXPECT_LT((at - Eigen::Vector3d(0.0, 0.0, surface.at("z").get<double>() - 2.0)).norm(), 1e-2);
  const Ran told = Run({"map", "georeference", "m", "--origin", "47.1,8.2,500"});
  ASSERT_EQ(told.exit_code, 0) << told.err;
  EXPECT_EQ(json::parse(told.out).at("origin"), (json{47.1, 8.2, 500.0}));
  EXPECT_EQ(json::parse(told.out).at("was"), fit.at("origin"));
  EXPECT_EQ(Run({"map", "georeference", "m", "--origin", "97.1,8.2,500"}).exit_code, 1);
  const json plan = json::parse(Run({"plan", "m", "--from", "40,-7", "--to", "41,-6"}).out);
  ASSERT_EQ(plan.at("found"), true) << plan.dump();
  EXPECT_EQ(plan.at("waypoints_on_earth").size(), plan.at("waypoints").size());
  EXPECT_NEAR(plan.at("waypoints_on_earth").at(0).at(0).get<double>(), 47.1, 1e-3);
}

}  // namespace
}  // namespace strata::cli
