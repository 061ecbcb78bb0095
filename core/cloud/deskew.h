// Takes the motion out of the points of a scanner that turned or tilted while its robot moved: each
// was measured from where the sensor was at that moment (thesis 4.2, equations 4.2 and 4.3: the
// chain of joints, here the robot itself).
#ifndef STRATA_CORE_CLOUD_DESKEW_H_
#define STRATA_CORE_CLOUD_DESKEW_H_

#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata {

// No scan takes longer, from its stamp to its last point.
inline constexpr double kLongestScanS = 30.0;

// How many seconds after the scan's stamp each point was measured, by `cloud.time`; 0 where there
// is no point. Drivers do not say the unit: whole numbers are nanoseconds, or microseconds where
// the scan would be over in less than a millisecond; numbers with fractions have the largest of the
// units s, ms, µs, ns in which it lasts no longer than kLongestScanS. They count from the stamp
// or, where that brings them nearer than kLongestScanS, from the zero that `stamp_s` counts from.
//
// FAILED_PRECONDITION if the cloud has no times or all are the same; INVALID_ARGUMENT if one is not
// finite, the scan would last too long, or they are neither near zero nor near the stamp: another
// clock's.
absl::StatusOr<std::vector<double>> PointOffsets(const PointCloud& cloud, double stamp_s);

// The cloud as the sensor would have seen it all at once at `stamp_s`, without times. `pose_at`
// gives T_map_scan so many seconds after the stamp; it is asked at 0 and once a millisecond along
// the scan, and points go straight between (a chord: 0.05 mm at 100 m and 2 rad/s).
// `sensor_origin` stays, so that rays begin where the sensor was at the stamp.
//
// As PointOffsets(), `pose_at` and ValidateCloud().
absl::StatusOr<PointCloud> Deskew(PointCloud cloud,
                                  double stamp_s,
                                  absl::FunctionRef<absl::StatusOr<Pose>(double offset_s)> pose_at);

}  // namespace strata

#endif  // STRATA_CORE_CLOUD_DESKEW_H_
