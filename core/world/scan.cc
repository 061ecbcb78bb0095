#include "core/world/scan.h"

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/common/status.h"
#include "core/geometry/pose.h"
#include "core/world/names.h"

namespace strata {
namespace {

bool IsContentHash(absl::string_view text) {
  return text.size() == 32 && text.find_first_not_of("0123456789abcdef") == absl::string_view::npos;
}

}  // namespace

std::string ScanId::ToString() const { return absl::StrCat(trajectory, "/", sequence); }

absl::Status ParseScanId(absl::string_view text, ScanId& id) {
  const std::size_t slash = text.rfind('/');
  if (slash == absl::string_view::npos || !absl::SimpleAtoi(text.substr(slash + 1), &id.sequence)) {
    return absl::InvalidArgumentError(
        absl::StrCat("scan '", text.substr(0, 200), "': write TRAJECTORY/SEQUENCE, as in run1/42"));
  }
  id.trajectory = std::string(text.substr(0, slash));
  return ValidateName("trajectory name", id.trajectory);
}

void AnnouncePoints(const PointCloud& cloud, ScanHeader& header) {
  header.T_map_scan.translate(cloud.origin);
  header.sensor_origin = cloud.sensor_origin;
  header.point_count = cloud.size();
  header.rows = cloud.rows;
  header.columns = cloud.columns;
  header.has_intensity = !cloud.intensity.empty();
  header.has_colour = !cloud.colour.empty();
  header.has_label = !cloud.label.empty();
}

absl::Status ValidateScanHeader(const ScanHeader& header) {
  STRATA_RETURN_IF_ERROR(ValidateName("trajectory name", header.id.trajectory));
  const std::string what = absl::StrCat("scan ", header.id.ToString());
  if (header.id.sequence > (std::uint64_t{1} << 62)) {
    return absl::InvalidArgumentError(absl::StrCat(what, ": sequence is beyond 2^62"));
  }
  if (const absl::Status pose = ValidatePose(header.T_map_scan); !pose.ok()) {
    return Annotate(pose, what);
  }
  if (header.sensor.has_value()) {
    if (const absl::Status sensor = ValidateSensorModel(*header.sensor); !sensor.ok()) {
      return Annotate(sensor, what);
    }
  }
  if (!(header.sensor_origin.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= 1e6F)) {
    return absl::InvalidArgumentError(absl::StrCat(what, ": sensor_origin is not within ±1e6 m"));
  }
  if (header.time < absl::UnixEpoch() || header.time > absl::FromUnixSeconds(253402300799)) {
    return absl::InvalidArgumentError(absl::StrCat(what, ": time is not within 1970 to 9999"));
  }
  if (!header.content_hash.empty() && !IsContentHash(header.content_hash)) {
    return absl::InvalidArgumentError(absl::StrCat(what,
                                                   ": content_hash '",
                                                   header.content_hash.substr(0, 64),
                                                   "' is not 32 lower-case hexadecimal digits"));
  }
  const std::uint64_t grid = std::uint64_t{header.rows} * header.columns;
  if ((header.rows != 0 || header.columns != 0) && grid != header.point_count) {
    return absl::InvalidArgumentError(absl::StrCat(what,
                                                   ": a grid of ",
                                                   header.rows,
                                                   " × ",
                                                   header.columns,
                                                   " does not hold ",
                                                   header.point_count,
                                                   " points"));
  }
  return absl::OkStatus();
}

}  // namespace strata
