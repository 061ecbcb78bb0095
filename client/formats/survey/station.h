// One of the scans of a file that holds several: what the scanner saw from one place.
#ifndef STRATA_CLIENT_FORMATS_SURVEY_STATION_H_
#define STRATA_CLIENT_FORMATS_SURVEY_STATION_H_

#include <functional>
#include <optional>

#include "absl/status/statusor.h"
#include "absl/time/time.h"

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata {

struct Station {
  // From the scanner's frame, that of the points, into the one that the file's scans share.
  Pose T_file_scan = Pose::Identity();
  std::optional<absl::Time> time = {};
  // Opens the file anew: may be called by several threads.
  std::function<absl::StatusOr<PointCloud>()> read;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SURVEY_STATION_H_
