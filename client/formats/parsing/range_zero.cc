#include "client/formats/parsing/range_zero.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

namespace strata {
namespace {

// Whether each point is a return of range 0.
std::vector<bool> AreAtSensor(const PointCloud& cloud) {
  const Eigen::Vector3f zero = (-cloud.origin).cast<float>();
  const bool said = !cloud.sensor_origin.isZero(0.0F);
  std::vector<bool> at_sensor(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f& p = cloud.points[i];
    at_sensor[i] = p == zero || (said && p == cloud.sensor_origin);
  }
  return at_sensor;
}

template <typename Value>
void Drop(const std::vector<bool>& dropped, std::vector<Value>& column) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < column.size(); ++i) {
    if (!dropped[i]) column[kept++] = column[i];
  }
  column.resize(kept);
}

// Takes returns of range 0 out, or makes holes of the grid of them; how many.
std::size_t DropAtSensor(PointCloud& cloud) {
  const std::vector<bool> dropped = AreAtSensor(cloud);
  const auto count = static_cast<std::size_t>(std::count(dropped.begin(), dropped.end(), true));
  if (count == 0) return 0;
  if (cloud.organised()) {
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (dropped[i]) cloud.points[i].setConstant(kNaN);
    }
    return count;
  }
  Drop(dropped, cloud.points);
  Drop(dropped, cloud.intensity);
  Drop(dropped, cloud.colour);
  Drop(dropped, cloud.label);
  Drop(dropped, cloud.time);
  return count;
}

}  // namespace

absl::StatusOr<PointCloud> WithoutRangeZero(PointCloud cloud, std::size_t* at_sensor) {
  const std::size_t dropped = DropAtSensor(cloud);
  if (at_sensor != nullptr) *at_sensor = dropped;
  if (dropped > 0 && CountFinite(cloud) == 0) {
    return absl::InvalidArgumentError(absl::StrCat("all of ", dropped, " returns have range 0"));
  }
  return cloud;
}

}  // namespace strata
