#include "core/engine/scans/matching.h"

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/geometry/pose.h"
#include "core/storage/records.h"

namespace strata {
namespace {

// Without it a robot on a ramp takes the underside of the deck ahead for its top.
TEST(MatchingTest, FeaturesAreToldTheVerticalOfTheUploadedPose) {
  const Eigen::AngleAxisd yaw(2.1, Eigen::Vector3d::UnitZ());
  const Eigen::AngleAxisd climb(-0.2, Eigen::Vector3d::UnitY());  // nose up
  ScanRecord scan;
  scan.header.T_map_scan = Pose(Eigen::Translation3d(3.0, -2.0, 1.5) * yaw * climb);
  const Eigen::Vector3d up = FeatureOptionsOf(scan).up;
  // Of a climbing robot the vertical leans to its nose, and what is ahead lies above the horizon.
  EXPECT_NEAR(up.x(), std::sin(0.2), 1e-12);
  EXPECT_NEAR(up.y(), 0.0, 1e-12);
  EXPECT_NEAR(up.z(), std::cos(0.2), 1e-12);
}

}  // namespace
}  // namespace strata
