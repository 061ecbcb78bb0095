// strata posegraph track, on a database that the test decides on.
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/motion/trajectory_file.h"
#include "tests/client/cli/commands_fixture.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata::cli {
namespace {

using ::testing::_;
using ::testing::HasSubstr;
using ::testing::SizeIs;

class FakeTracking final : public api::Tracking {
 public:
  explicit FakeTracking(std::vector<TrackStep>& steps) : steps_(steps) {}

  // Where odometry says, two metres higher; the second scan is not believed.
  absl::StatusOr<TrackedPose> Step(const TrackStep& step) override {
    steps_.push_back(step);
    TrackedPose pose;
    pose.state = steps_.size() == 2 ? TrackState::kLost : TrackState::kTracked;
    pose.known = true;
    pose.T_map_scan = step.T_odom_scan;
    pose.T_map_scan.translation().z() += 2.0;
    pose.covariance = 0.01 * Matrix6d::Identity();
    pose.score = steps_.size() == 2 ? 0.0 : 0.9;
    pose.message = steps_.size() == 2 ? "no scan of the map looks alike" : "";
    pose.epoch = 3;
    return pose;
  }

 private:
  std::vector<TrackStep>& steps_;
};

class TrackCommandTest : public CommandsTest {
 protected:
  void SetUp() override {
    ON_CALL(db_.posegraph(), Track(_, _, _))
        .WillByDefault([this](auto&, auto, const TrackStart& start)
                           -> absl::StatusOr<std::unique_ptr<api::Tracking>> {
          start_ = start;
          return std::make_unique<FakeTracking>(steps_);
        });
    for (const char* name : {"s1.xyz", "s2.xyz", "s3.xyz"}) {
      // Far coordinates, which the reader keeps apart from the points.
      std::ofstream(dir_.path() / name) << "500000 0 0\n500001 0 0\n500000 1 0\n";
    }
    std::ofstream(dir_.path() / "poses.txt") << "1 10.5 1 0 0 0 0 0 1\n"
                                             << "2 11.5 2 0 0 0 0 0 1\n"
                                             << "3 12.5 3 0 0 0 0 0 1\n";
  }

  const ::strata::testing::TempDir dir_;
  TrackStart start_;
  std::vector<TrackStep> steps_;
};

TEST_F(TrackCommandTest, FollowsTheScansOfAFolder) {
  const std::string out = (dir_.path() / "run.csv").string();
  STRATA_ASSERT_OK(Run({"posegraph",
                        "track",
                        "m",
                        dir_.path().string(),
                        "--guess",
                        "1,2,3,0.5rad",
                        "--radius",
                        "7",
                        "--out",
                        out}));
  EXPECT_EQ(start_.guess_radius_m, 7.0);
  EXPECT_EQ(start_.T_map_scan_guess->translation().y(), 2.0);
  ASSERT_THAT(steps_, SizeIs(3));
  EXPECT_TRUE(steps_[0].cloud.origin.isZero());
  EXPECT_EQ(steps_[0].cloud.size(), 3U);
  std::vector<Json> lines;
  std::istringstream text(data_.str());
  for (std::string line; std::getline(text, line);) lines.push_back(Json::parse(line));
  ASSERT_THAT(lines, SizeIs(3));
  EXPECT_EQ(lines[0]["scan"], "s1.xyz");
  EXPECT_EQ(lines[0]["state"], "tracked");
  // In the frame of the file, whatever its origin.
  EXPECT_NEAR(lines[0]["pose"][0].get<double>(), 1.0, 1e-6);
  EXPECT_NEAR(lines[0]["pose"][2].get<double>(), 2.0, 1e-6);
  EXPECT_EQ(lines[1]["state"], "lost");
  EXPECT_EQ(lines[2]["epoch"], 3);
  EXPECT_THAT(lines[2]["covariance"], SizeIs(6));
  STRATA_ASSERT_OK_AND_ASSIGN(const TrajectoryFile run, ReadTrajectory(out));
  ASSERT_THAT(run.trajectory.poses(), SizeIs(3));
  EXPECT_EQ(run.trajectory.poses()[1].time_s, 11.5);
  EXPECT_NEAR(run.trajectory.poses()[1].T_map_body.translation().x(), 2.0, 1e-6);
  EXPECT_EQ(run.trajectory.poses()[1].covariance(3, 3), 0.01);
}

TEST_F(TrackCommandTest, SaysInWordsWhatCameOfEveryScan) {
  const std::string text = RunText({"posegraph", "track", "m", dir_.path().string()});
  EXPECT_THAT(text, HasSubstr("s1.xyz           tracked   score 0.90  1.000, 0.000, 2.000  sigma"));
  EXPECT_THAT(text, HasSubstr("no scan of the map looks alike"));
  EXPECT_THAT(text, HasSubstr("3 scans: 2 tracked, 0 predicted, 1 lost"));
}

}  // namespace
}  // namespace strata::cli
