#include "client/formats/motion/rig_file.h"

#include <numbers>
#include <string>

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

class RigFileTest : public ::testing::Test {
 protected:
  absl::Status Read(const std::string& text) {
    const auto file = dir_.path() / "rig.yaml";
    STRATA_EXPECT_OK(WriteFileBytes(file, text));
    return ReadRig(file, rig_);
  }
  testing::TempDir dir_;
  Rig rig_;
};

TEST_F(RigFileTest, SetsWhatItSaysAndLeavesTheRest) {
  rig_.gps.lag_s = 0.5;
  STRATA_ASSERT_OK(
      Read("# a car\nimu:\n  orientation: [90, 0, -90]\n  position: [0, -0.3, 0.52]\n"
           "  yaw_mount: 3\ngps: {antenna: [0.1, 0.2, 1.5]}\nwheels:\n  speed: 0.2\n"));
  ASSERT_TRUE(rig_.R_body_imu.has_value());
  // y up, x to the right.
  EXPECT_LT((*rig_.R_body_imu * Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((*rig_.R_body_imu * Eigen::Vector3d::UnitX() + Eigen::Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_EQ(rig_.imu_body_m, Eigen::Vector3d(0, -0.3, 0.52));
  EXPECT_NEAR(rig_.yaw_mount_rad, 3.0 * std::numbers::pi / 180.0, 1e-12);
  EXPECT_EQ(rig_.gps.antenna_body_m, Eigen::Vector3d(0.1, 0.2, 1.5));
  EXPECT_DOUBLE_EQ(rig_.gps.lag_s, 0.5);
  EXPECT_DOUBLE_EQ(rig_.wheels.speed_m_s, 0.2);
  STRATA_EXPECT_OK(Read(""));
}

TEST_F(RigFileTest, ErrorsNameKeyAndWhatWasExpected) {
  const auto expect = [this](const std::string& text, const std::string& message) {
    EXPECT_THAT(Read(text),
                StatusIs(absl::StatusCode::kInvalidArgument,
                         AllOf(HasSubstr("rig.yaml"), HasSubstr(message))));
  };
  expect("imu: {colour: 3}", "imu has no key 'colour'; it has accelerometer_bias");
  expect("camera: {}", "a rig has no key 'camera'; it has gps, imu, wheels");
  expect("imu: 5", "imu: expected keys below it");
  expect("5", "expected the keys gps, imu, wheels");
  expect("gps: {lag: soon}", "gps.lag: expected a number");
  expect("gps: {lag: .nan}", "gps.lag: expected a number");
  expect("gps: {antenna: [1, 2]}", "gps.antenna: expected three numbers");
  expect("gps: {antenna: [1, 2, x]}", "gps.antenna: expected a number");
  expect("gps: {lag: 20}", "gps.lag is 20, must be in [-10, 10]");
  expect("gps: {lag: [", "line 1");
  EXPECT_THAT(ReadRig(dir_.path() / "none.yaml", rig_),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("none.yaml")));
}

}  // namespace
}  // namespace strata
