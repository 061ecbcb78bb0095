#include "client/formats/motion/trajectory_file.h"

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_replace.h"
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/file_bytes.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::StatusIs;

class TrajectoryFileTest : public ::testing::Test {
 protected:
  static TrajectoryFile Two() {
    std::vector<TrajectoryPose> poses(2);
    for (int i = 0; i < 2; ++i) {
      poses[i].time_s = 1432235498.028276 + i;
      poses[i].T_map_body =
          MakePose(Eigen::Quaterniond(So3Exp({0.1, 0.2, 3.0})), {1.5, 1.0 * i, -2.0});
      poses[i].covariance.setConstant(1e-5);
      poses[i].covariance.diagonal() = Vector6d::LinSpaced(0.1, 0.6);
    }
    auto trajectory = Trajectory::Make(std::move(poses));
    STRATA_EXPECT_OK(trajectory.status());
    return {*std::move(trajectory), GeodeticOrigin{0.7, -1.2, 33.25}};
  }
  absl::StatusOr<TrajectoryFile> Read(const std::string& text) {
    const auto file = dir_.path() / "run.csv";
    STRATA_EXPECT_OK(WriteFileBytes(file, text));
    return ReadTrajectory(file);
  }
  testing::TempDir dir_;
};

TEST_F(TrajectoryFileTest, ComesBack) {
  const TrajectoryFile two = Two();
  STRATA_ASSERT_OK_AND_ASSIGN(const TrajectoryFile read, Read(TrajectoryText(two)));
  ASSERT_EQ(read.trajectory.poses().size(), 2U);
  const TrajectoryPose &a = read.trajectory.poses()[1], &b = two.trajectory.poses()[1];
  EXPECT_NEAR(a.time_s, b.time_s, 1e-6);
  EXPECT_TRUE(a.T_map_body.isApprox(b.T_map_body, 1e-9));
  EXPECT_LT((a.covariance - b.covariance).norm(), 1e-8);
  ASSERT_TRUE(read.origin.has_value());
  EXPECT_NEAR(read.origin->latitude_rad, 0.7, 1e-10);
  EXPECT_NEAR(read.origin->longitude_rad, -1.2, 1e-10);
  EXPECT_NEAR(read.origin->altitude_m, 33.25, 1e-9);
}

TEST_F(TrajectoryFileTest, NeedsNoOrigin) {
  TrajectoryFile two = Two();
  two.origin.reset();
  STRATA_ASSERT_OK_AND_ASSIGN(const TrajectoryFile read, Read(TrajectoryText(two)));
  EXPECT_FALSE(read.origin.has_value());
}

TEST_F(TrajectoryFileTest, ErrorsNameFileAndWhatWasExpected) {
  const std::string text = TrajectoryText(Two());
  const auto expect = [this](const std::string& spoiled, const std::string& message) {
    EXPECT_THAT(Read(spoiled),
                StatusIs(absl::StatusCode::kInvalidArgument,
                         AllOf(HasSubstr("run.csv"), HasSubstr(message))));
  };
  expect("time,x,y\n", "has no column 'z'");
  expect(absl::StrReplaceAll(text, {{"# origin ", "# origin north "}}), "expected '# origin LAT");
  expect(absl::StrReplaceAll(text, {{"1432235499.", "1432235497."}}), "times must ascend");
  expect(absl::StrReplaceAll(text, {{",0.1,", ",-0.1,"}}), "a variance is negative");
  expect(absl::StrReplaceAll(text, {{",0.1,", ",half,"}}), "expected a number as c00, got 'half'");
  expect(absl::StrReplaceAll(text, {{",1.500000,", ",1.500000,0,0,1,"}}), "quaternion has length");
}

}  // namespace
}  // namespace strata
