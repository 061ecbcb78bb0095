#include "client/formats/motion/recorded_log.h"

#include <filesystem>
#include <string>

#include "absl/strings/str_cat.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/file_bytes.h"
#include "tests/support/data_dir.h"
#include "tests/support/simulator/simulated_drive.h"
#include "tests/support/status_matchers.h"
#include "tests/support/temp_dir.h"

namespace strata {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::StatusIs;

class RecordedLogTest : public ::testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) {
    STRATA_EXPECT_OK(WriteFileBytes(dir_.path() / name, text));
  }
  testing::TempDir dir_;
};

TEST_F(RecordedLogTest, RosMessagesAsCsvComeBack) {
  testing::DriveOptions options;
  options.seconds = 5.0;
  const MotionLog log = testing::SimulateDrive(options, 1);
  std::filesystem::create_directory(dir_.path() / "robot");
  testing::WriteDrive(log, dir_.path() / "robot");
  for (const auto& folder : {dir_.path(), dir_.path() / "robot"}) {
    STRATA_ASSERT_OK_AND_ASSIGN(const RecordedLog read, ReadRecordedLog(folder));
    ASSERT_EQ(read.log.imu.size(), log.imu.size());
    ASSERT_EQ(read.log.wheels.size(), log.wheels.size());
    ASSERT_EQ(read.log.fixes.size(), log.fixes.size());
    const ImuSample &imu = read.log.imu[77], &other = log.imu[77];
    EXPECT_NEAR(imu.time_s, other.time_s, 1e-6);
    EXPECT_LT((imu.angular_rate_rad_s - other.angular_rate_rad_s).norm(), 1e-8);
    EXPECT_LT((imu.specific_force_m_s2 - other.specific_force_m_s2).norm(), 1e-8);
    EXPECT_NEAR(read.log.wheels[9].speed_m_s, log.wheels[9].speed_m_s, 1e-8);
    EXPECT_NEAR(read.log.fixes[3].latitude_rad, log.fixes[3].latitude_rad, 1e-12);
    EXPECT_NEAR(read.log.fixes[3].sigma_m.z(), log.fixes[3].sigma_m.z(), 1e-6);
  }
}

TEST_F(RecordedLogTest, WithoutWheelsAndWithRowsThatAreNoFix) {
  Write("imu.csv", "wx,wy,wz,stamp,ax,ay,az\n0,0,0,1.5,0,0,9.8\n");
  Write("gps.csv",
        "stamp,lat,lon,alt,var_e,var_n,var_u,status\n1,60,9,2,1,4,9,-1\n2,60,9,2,1,4,9,0\n");
  STRATA_ASSERT_OK_AND_ASSIGN(const RecordedLog read, ReadRecordedLog(dir_.path()));
  EXPECT_TRUE(read.log.wheels.empty());
  EXPECT_DOUBLE_EQ(read.log.imu[0].time_s, 1.5);
  ASSERT_EQ(read.log.fixes.size(), 1U);
  EXPECT_EQ(read.log.fixes[0].sigma_m, Eigen::Vector3d(1, 2, 3));
}

TEST_F(RecordedLogTest, ErrorsNameFileLineAndCure) {
  constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
  EXPECT_THAT(ReadRecordedLog(dir_.path() / "none"),
              StatusIs(absl::StatusCode::kNotFound, HasSubstr("is no folder")));
  EXPECT_THAT(ReadRecordedLog(dir_.path()),
              StatusIs(absl::StatusCode::kNotFound,
                       AllOf(HasSubstr("no log that is known"), HasSubstr("stamp,wx,wy,wz"))));
  Write("imu.csv", "stamp,wx,wy,wz,ax,ay,az\n1,0,0,0,0,0,9.8\n2,0,0,zero,0,0,9.8\n");
  Write("gps.csv", "stamp,lat,lon,alt,var_e,var_n\n");
  EXPECT_THAT(ReadRecordedLog(dir_.path()),
              StatusIs(kInvalid,
                       AllOf(HasSubstr("imu.csv: line 3"),
                             HasSubstr("expected a number as wz, got 'zero'"))));
  Write("imu.csv", "stamp,wx,wy,wz,ax,ay,az\n1,0,0,0,0,0,9.8\n");
  EXPECT_THAT(ReadRecordedLog(dir_.path()),
              StatusIs(kInvalid, AllOf(HasSubstr("gps.csv"), HasSubstr("no column 'var_u'"))));
}

// As when a robot lost its power while it wrote.
TEST_F(RecordedLogTest, ALastLineThatIsCutIsLeftOut) {
  const std::string header = "stamp,wx,wy,wz,ax,ay,az\n";
  Write("gps.csv", "stamp,lat,lon,alt,var_e,var_n,var_u\n1,60,9,2,1,4,9\n2,60,9");
  for (const char* cut : {"", "2", "2,0,0,0", "2,0,0,0,0,0,", "2,0,0,0,0,0,-"}) {
    Write("imu.csv", absl::StrCat(header, "1,0,0,0,0,0,9.8\n", cut));
    STRATA_ASSERT_OK_AND_ASSIGN(const RecordedLog read, ReadRecordedLog(dir_.path()));
    EXPECT_EQ(read.log.imu.size(), 1U) << cut;
    EXPECT_EQ(read.log.fixes.size(), 1U);
  }
  Write("imu.csv", absl::StrCat(header, "2,0,0"));
  EXPECT_THAT(ReadRecordedLog(dir_.path()),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("line 2")));
}

TEST_F(RecordedLogTest, Husky) {
  STRATA_REQUIRE_DATA(folder, "husky_gps_imu_odom");
  STRATA_ASSERT_OK_AND_ASSIGN(const RecordedLog read, ReadRecordedLog(folder));
  EXPECT_EQ(read.log.imu.size(), 11865U);
  EXPECT_EQ(read.log.wheels.size(), 3952U);
  EXPECT_EQ(read.log.fixes.size(), 989U);
  EXPECT_NEAR(read.log.fixes[0].sigma_m.x(), 0.9, 1e-9);
}

TEST_F(RecordedLogTest, Dresden) {
  STRATA_REQUIRE_DATA(folder, "dresden_car_gps_imu");
  STRATA_ASSERT_OK_AND_ASSIGN(const RecordedLog read, ReadRecordedLog(folder));
  EXPECT_EQ(read.log.imu.size(), 10800U);
  EXPECT_EQ(read.log.fixes.size(), 2117U);
  double up = 0.0;
  for (const ImuSample& sample : read.log.imu) up += sample.specific_force_m_s2.z();
  EXPECT_NEAR(up / 10800.0, 9.6, 0.1);
}

}  // namespace
}  // namespace strata
