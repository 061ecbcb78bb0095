#include "core/engine/scans/scan_losses.h"

#include <algorithm>
#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace strata {
namespace {

std::string RangeOf(const ScanHeader& header, const SensorModel& sensor) {
  const Eigen::Vector3f& at = header.sensor_origin;
  return absl::StrCat("within range [",
                      sensor.min_range_m,
                      ", ",
                      sensor.max_range_m,
                      "] m of the sensor at (",
                      at.x(),
                      ", ",
                      at.y(),
                      ", ",
                      at.z(),
                      ")");
}

}  // namespace

absl::Status CheckContributes(const MlsMap& contribution,
                              const DroppedPoints& dropped,
                              const ScanRecord& scan,
                              const SensorModel& sensor) {
  const bool any = std::any_of(contribution.tiles.begin(),
                               contribution.tiles.end(),
                               [](const MlsTile& tile) { return !tile.patches.empty(); });
  // A pose takes points out of the map's bounds only.
  if (any || (scan.faded_points > 0 && dropped.outside_map == 0)) return absl::OkStatus();
  const ScanHeader& header = scan.header;
  const std::uint64_t points = header.point_count - scan.faded_points;
  const std::string what = absl::StrCat("scan ", header.id.ToString(), ": ");
  if (dropped.not_finite == points) {
    return absl::InvalidArgumentError(absl::StrCat(what, "none of ", points, " points is finite"));
  }
  if (dropped.not_finite + dropped.out_of_range == points) {
    return absl::InvalidArgumentError(
        absl::StrCat(what,
                     "0 of ",
                     points,
                     " points ",
                     RangeOf(header, sensor),
                     "; set the sensor origin or the sensor's max range"));
  }
  return absl::InvalidArgumentError(absl::StrCat(what,
                                                 "0 of ",
                                                 points,
                                                 " points within what a map can hold: ",
                                                 kMaxCellIndex,
                                                 " cells to each side, ",
                                                 kMaxZTicks / kTicksPerMetre + 1,
                                                 " m up and down; check the pose"));
}

std::string DescribeLosses(const DroppedPoints& dropped,
                           const ScanHeader& header,
                           const SensorModel& sensor) {
  const std::uint64_t lost = dropped.out_of_range + dropped.outside_map;
  if (lost == 0) return "";
  std::string text = absl::StrCat(lost, " of ", header.point_count, " points left out: ");
  if (dropped.out_of_range > 0) {
    absl::StrAppend(&text, dropped.out_of_range, " not ", RangeOf(header, sensor));
  }
  if (dropped.outside_map > 0) {
    absl::StrAppend(&text,
                    dropped.out_of_range > 0 ? ", " : "",
                    dropped.outside_map,
                    " beyond what a map can hold");
  }
  return text;
}

}  // namespace strata
