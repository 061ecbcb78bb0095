#include "core/cloud/deskew.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/spun_scan.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::strata::testing::StatusIs;
using ::testing::HasSubstr;

constexpr double kStampS = 1.7e9 + 0.25;

using ::strata::testing::kSpinS;
using ::strata::testing::Spin;
using ::strata::testing::SpinnerPose;
using ::strata::testing::SpunScan;

absl::StatusOr<Pose> PoseAt(double offset_s) { return SpinnerPose(offset_s); }

std::vector<double> Times(const SpunScan& scan, double zero_s, double unit_s, bool whole) {
  std::vector<double> times;
  for (const double offset_s : scan.offset_s) {
    const double time = (zero_s + offset_s) / unit_s;
    times.push_back(whole ? std::round(time) : time);
  }
  return times;
}

// In every unit that drivers use, from the stamp or absolute, stamped at the beginning, in the
// middle or at the end of the turn.
TEST(DeskewTest, PointsAreWhereTheyBelongWithinMillimetres) {
  struct Form {
    const char* what;
    double zero_s, unit_s;
    bool whole;
  };
  for (const double first_s : {0.0, -0.05, -kSpinS}) {
    const SpunScan scan = Spin(0.0, first_s);
    EXPECT_GT(scan.WorstError(scan.cloud), 0.3);
    for (const Form& form : {Form{"Velodyne, seconds", 0.0, 1.0, false},
                             Form{"milliseconds", 0.0, 1e-3, false},
                             Form{"Ouster, nanoseconds", 0.0, 1e-9, true},
                             Form{"whole microseconds", 0.0, 1e-6, true},
                             Form{"Hesai, seconds since 1970", kStampS, 1.0, false},
                             Form{"Livox, nanoseconds since 1970", kStampS, 1e-9, true}}) {
      SCOPED_TRACE(form.what);
      PointCloud cloud = scan.cloud;
      cloud.time = Times(scan, form.zero_s, form.unit_s, form.whole);
      STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud deskewed, Deskew(cloud, kStampS, PoseAt));
      EXPECT_LT(scan.WorstError(deskewed), 1e-3);
      EXPECT_TRUE(deskewed.time.empty());
    }
  }
}

// 40 poses a second and straight screws between them, as a trajectory of strata egomotion has.
TEST(DeskewTest, PosesOfATrajectoryAreEnough) {
  const SpunScan scan = Spin(0.0, 0.0);
  PointCloud cloud = scan.cloud;
  cloud.time = Times(scan, 0.0, 1.0, false);
  const auto between = [](double offset_s) -> absl::StatusOr<Pose> {
    const double at = std::floor(offset_s / 0.025) * 0.025;
    const Pose a = SpinnerPose(at), b = SpinnerPose(at + 0.025);
    const double share = (offset_s - at) / 0.025;
    const Eigen::Quaterniond q =
        Eigen::Quaterniond(a.linear()).slerp(share, Eigen::Quaterniond(b.linear()));
    return MakePose(q, (1.0 - share) * a.translation() + share * b.translation());
  };
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud deskewed, Deskew(cloud, kStampS, between));
  EXPECT_LT(scan.WorstError(deskewed), 5e-3);
}

TEST(DeskewTest, HolesStayAndDoNotCount) {
  const SpunScan scan = Spin(0.0, 0.0);
  PointCloud cloud = scan.cloud;
  cloud.time = Times(scan, 0.0, 1e-9, true);
  cloud.rows = 1;
  cloud.columns = static_cast<std::uint32_t>(cloud.size());
  cloud.origin = {100.0, -200.0, 0.0};
  for (Eigen::Vector3f& p : cloud.points) p -= cloud.origin.cast<float>();
  cloud.points[7].setConstant(std::numeric_limits<float>::quiet_NaN());
  cloud.time[7] = 9e18;
  STRATA_ASSERT_OK_AND_ASSIGN(PointCloud deskewed, Deskew(cloud, kStampS, PoseAt));
  EXPECT_TRUE(deskewed.points[7].array().isNaN().all());
  deskewed.points[7] = (scan.true_at[7] - cloud.origin).cast<float>();
  EXPECT_LT(scan.WorstError(deskewed), 1e-3);
}

TEST(DeskewTest, TimesThatAreNoneAreRefused) {
  SpunScan scan = Spin(0.0, 0.0);
  EXPECT_THAT(Deskew(scan.cloud, kStampS, PoseAt),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("no times")));
  scan.cloud.time.assign(scan.cloud.size(), 5.0);
  EXPECT_THAT(Deskew(scan.cloud, kStampS, PoseAt),
              StatusIs(absl::StatusCode::kFailedPrecondition, HasSubstr("one and the same")));
  scan.cloud.time = Times(scan, 4242.0, 1.0, false);
  EXPECT_THAT(Deskew(scan.cloud, kStampS, PoseAt),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("another clock's")));
  scan.cloud.time.front() = 1e30;
  EXPECT_THAT(Deskew(scan.cloud, kStampS, PoseAt),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("lasts more than 30 s")));
  scan.cloud.time.front() = std::numeric_limits<double>::infinity();
  EXPECT_THAT(Deskew(scan.cloud, kStampS, PoseAt),
              StatusIs(absl::StatusCode::kInvalidArgument, HasSubstr("point 0 is not finite")));
  scan.cloud.time = Times(scan, 0.0, 1.0, false);
  const auto nowhere = [](double offset_s) -> absl::StatusOr<Pose> {
    if (offset_s <= 0.05) return Pose::Identity();
    return absl::OutOfRangeError("the trajectory ends");
  };
  EXPECT_THAT(Deskew(scan.cloud, kStampS, nowhere),
              StatusIs(absl::StatusCode::kOutOfRange, HasSubstr("the trajectory ends")));
}

}  // namespace
}  // namespace strata
