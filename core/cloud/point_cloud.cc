#include "core/cloud/point_cloud.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "core/common/status.h"

namespace strata {
namespace {

constexpr float kMaxCoordinateM = 1e6F;

absl::Status CheckColumn(const char* name, std::size_t length, std::size_t points) {
  if (length == 0 || length == points) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("cloud: ", name, " has ", length, " entries for ", points, " points"));
}

// Without a branch, which most clouds are all they need; false also for the holes of a grid.
bool AreWithin(const std::vector<Eigen::Vector3f>& points) {
  std::uint32_t beyond = 0;
  for (const Eigen::Vector3f& p : points) {
    for (const float c : {p.x(), p.y(), p.z()}) beyond |= std::abs(c) <= kMaxCoordinateM ? 0U : 1U;
  }
  return beyond == 0;
}

}  // namespace

absl::Status CheckColumns(const PointCloud& cloud) {
  const std::size_t n = cloud.size();
  STRATA_RETURN_IF_ERROR(CheckColumn("intensity", cloud.intensity.size(), n));
  STRATA_RETURN_IF_ERROR(CheckColumn("colour", cloud.colour.size(), n));
  STRATA_RETURN_IF_ERROR(CheckColumn("time", cloud.time.size(), n));
  return CheckColumn("label", cloud.label.size(), n);
}

absl::Status ValidateCloud(const PointCloud& cloud) {
  STRATA_RETURN_IF_ERROR(CheckColumns(cloud));
  const std::size_t n = cloud.size();
  const bool half_a_grid = (cloud.rows == 0) != (cloud.columns == 0);
  if (half_a_grid || std::uint64_t{cloud.rows} * cloud.columns != (cloud.organised() ? n : 0)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "cloud: grid of ", cloud.rows, " × ", cloud.columns, " does not hold ", n, " points"));
  }
  if (!cloud.origin.allFinite() || !cloud.sensor_origin.allFinite()) {
    return absl::InvalidArgumentError("cloud: origin is not finite");
  }
  if (AreWithin(cloud.points)) return absl::OkStatus();
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector3f& p = cloud.points[i];
    if (cloud.organised() && p.array().isNaN().all()) continue;
    // The negated comparison also catches NaN.
    if (!(p.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= kMaxCoordinateM)) {
      return absl::InvalidArgumentError(absl::StrCat(
          "cloud: point ", i, " (", p.x(), ", ", p.y(), ", ", p.z(), ") is not within ±1e6 m"));
    }
  }
  return absl::OkStatus();
}

std::size_t CountFinite(const PointCloud& cloud) {
  return static_cast<std::size_t>(
      std::count_if(cloud.points.begin(), cloud.points.end(), [](const Eigen::Vector3f& p) {
        return p.allFinite();
      }));
}

}  // namespace strata
