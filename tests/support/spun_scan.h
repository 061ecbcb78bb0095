// A scanner that turns ten times a second on a robot that drives and turns in a room: where its
// points belong is known.
#ifndef STRATA_TESTS_SUPPORT_SPUN_SCAN_H_
#define STRATA_TESTS_SUPPORT_SPUN_SCAN_H_

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata::testing {

inline constexpr double kSpinS = 0.1;

// 8 m/s along a curve of 1 rad/s, nodding.
inline Pose SpinnerPose(double time_s) {
  constexpr double kRadiusM = 8.0;
  const Eigen::Matrix3d R =
      So3Exp({0.0, 0.0, time_s}) * So3Exp({0.0, 0.02 * std::sin(5.0 * time_s), 0.0});
  return MakePose(Eigen::Quaterniond(R),
                  {kRadiusM * std::sin(time_s), kRadiusM * (1.0 - std::cos(time_s)), 1.5});
}

// From inside the room to its wall, floor or ceiling.
inline double RoomRange(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) {
  const Eigen::Array3d low(-30.0, -22.0, 0.0), high(40.0, 45.0, 9.0);
  double range = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const double wall = direction[k] > 0.0 ? high[k] : low[k];
    if (direction[k] != 0.0) range = std::min(range, (wall - from[k]) / direction[k]);
  }
  return range;
}

struct SpunScan {
  PointCloud cloud;                      // as the sensor has it, without times
  std::vector<double> offset_s;          // of each point, from the stamp
  std::vector<Eigen::Vector3d> true_at;  // in the sensor's frame at the stamp

  double WorstError(const PointCloud& of) const {
    double worst = of.size() == true_at.size() ? 0.0 : std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < std::min(of.size(), true_at.size()); ++i) {
      const Eigen::Vector3d p = of.origin + of.points[i].cast<double>();
      worst = std::max(worst, (p - true_at[i]).norm());
    }
    return worst;
  }
};

// One turn that begins `first_s` after its stamp.
inline SpunScan Spin(double stamp_s, double first_s) {
  constexpr int kColumns = 900, kRings = 8;
  SpunScan scan;
  for (int i = 0; i < kColumns * kRings; ++i) {
    const int ring = i % kRings;
    const double share = (i / kRings + ring / 16.0) / kColumns;
    const double offset_s = first_s + kSpinS * share;
    const double azimuth = -2.0 * std::numbers::pi * share;
    const double elevation = 0.04 * (ring - 4) - 0.01;
    const Eigen::Vector3d beam(std::cos(elevation) * std::cos(azimuth),
                               std::cos(elevation) * std::sin(azimuth),
                               std::sin(elevation));
    const Pose T = SpinnerPose(stamp_s + offset_s);
    const double range = RoomRange(T.translation(), T.linear() * beam);
    scan.cloud.points.push_back((range * beam).cast<float>());
    scan.offset_s.push_back(offset_s);
    scan.true_at.emplace_back(SpinnerPose(stamp_s).inverse() * (T * (range * beam)));
  }
  return scan;
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_SPUN_SCAN_H_
