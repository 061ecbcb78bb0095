#include "core/cloud/deskew.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_format.h"
#include <Eigen/Core>

#include "core/common/status.h"

namespace strata {
namespace {

constexpr double kKnotS = 1e-3;
constexpr double kShortestScanS = 1e-3;  // by which whole numbers are told apart

// What is said of the times of points.
struct TimeSpan {
  double first = std::numeric_limits<double>::infinity();
  double last = -first;
  bool whole = true;  // without fractions
};

absl::StatusOr<TimeSpan> SpanOf(const PointCloud& cloud) {
  if (cloud.time.empty()) return absl::FailedPreconditionError("the points have no times");
  TimeSpan span;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    const double time = cloud.time[i];
    if (!std::isfinite(time)) {
      return absl::InvalidArgumentError(absl::StrFormat("the time of point %d is not finite", i));
    }
    span.first = std::min(span.first, time);
    span.last = std::max(span.last, time);
    span.whole = span.whole && time == std::floor(time);
  }
  if (!(span.first < span.last)) {
    return absl::FailedPreconditionError("the points have one and the same time");
  }
  return span;
}

// In seconds; 0 if there is none.
double UnitOf(const TimeSpan& span) {
  const double length = span.last - span.first;
  if (span.whole) return 1e-9 * length >= kShortestScanS ? 1e-9 : 1e-6;
  for (const double unit_s : {1.0, 1e-3, 1e-6, 1e-9}) {
    if (unit_s * length <= kLongestScanS) return unit_s;
  }
  return 0.0;
}

// The time of the stamp, as the points have times.
absl::StatusOr<double> ZeroOf(const TimeSpan& span, double unit_s, double stamp_s) {
  for (const double zero_s : {0.0, stamp_s}) {
    const double early_s = zero_s - unit_s * span.first, late_s = unit_s * span.last - zero_s;
    if (std::max(early_s, late_s) <= kLongestScanS) return zero_s;
  }
  return absl::InvalidArgumentError(
      absl::StrFormat("the points' times, %.17g to %.17g, are within %.0f s neither of zero nor of "
                      "the scan's stamp, %.6f s: another clock's",
                      span.first,
                      span.last,
                      kLongestScanS,
                      stamp_s));
}

// Where the scan's frame was along the scan, in that of the stamp: evenly spaced in time.
struct Way {
  double first_s = 0.0, step_s = kKnotS;
  std::vector<Pose> T_stamp_scan;

  Eigen::Vector3d Moved(const Eigen::Vector3d& p, double offset_s) const {
    const double at = (offset_s - first_s) / step_s;
    const auto last = static_cast<double>(T_stamp_scan.size() - 2);
    const double before = std::clamp(std::floor(at), 0.0, last);
    const auto k = static_cast<std::size_t>(before);
    const double share = at - before;
    return (1.0 - share) * (T_stamp_scan[k] * p) + share * (T_stamp_scan[k + 1] * p);
  }
};

absl::StatusOr<Way> WayOf(double first_s,
                          double last_s,
                          absl::FunctionRef<absl::StatusOr<Pose>(double)> pose_at) {
  STRATA_ASSIGN_OR_RETURN(const Pose T_map_stamp, pose_at(0.0));
  const double steps = std::max(1.0, std::ceil((last_s - first_s) / kKnotS));
  Way way{first_s, (last_s - first_s) / steps, {}};
  for (double k = 0.0; k <= steps; k += 1.0) {
    const double offset_s = std::min(first_s + k * way.step_s, last_s);
    STRATA_ASSIGN_OR_RETURN(const Pose T_map_scan, pose_at(offset_s));
    way.T_stamp_scan.push_back(T_map_stamp.inverse() * T_map_scan);
  }
  return way;
}

}  // namespace

absl::StatusOr<std::vector<double>> PointOffsets(const PointCloud& cloud, double stamp_s) {
  STRATA_ASSIGN_OR_RETURN(const TimeSpan span, SpanOf(cloud));
  const double unit_s = UnitOf(span);
  if (!(unit_s > 0.0 && unit_s * (span.last - span.first) <= kLongestScanS)) {
    return absl::InvalidArgumentError(
        absl::StrFormat("by its points' times, %.17g to %.17g, the scan lasts more than %.0f s",
                        span.first,
                        span.last,
                        kLongestScanS));
  }
  STRATA_ASSIGN_OR_RETURN(const double zero_s, ZeroOf(span, unit_s, stamp_s));
  std::vector<double> offsets(cloud.size(), 0.0);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.points[i].allFinite()) offsets[i] = unit_s * cloud.time[i] - zero_s;
  }
  return offsets;
}

absl::StatusOr<PointCloud> Deskew(PointCloud cloud,
                                  double stamp_s,
                                  absl::FunctionRef<absl::StatusOr<Pose>(double)> pose_at) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<double> offsets, PointOffsets(cloud, stamp_s));
  double first_s = std::numeric_limits<double>::infinity(), last_s = -first_s;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!cloud.points[i].allFinite()) continue;
    first_s = std::min(first_s, offsets[i]);
    last_s = std::max(last_s, offsets[i]);
  }
  STRATA_ASSIGN_OR_RETURN(const Way way, WayOf(first_s, last_s, pose_at));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    Eigen::Vector3f& p = cloud.points[i];
    if (!p.allFinite()) continue;
    p = (way.Moved(cloud.origin + p.cast<double>(), offsets[i]) - cloud.origin).cast<float>();
  }
  cloud.time.clear();
  STRATA_RETURN_IF_ERROR(ValidateCloud(cloud));
  return cloud;
}

}  // namespace strata
