// Returns of range 0, as sensors write beams that came to nothing.
#ifndef STRATA_CLIENT_FORMATS_PARSING_RANGE_ZERO_H_
#define STRATA_CLIENT_FORMATS_PARSING_RANGE_ZERO_H_

#include <cstddef>

#include "absl/status/statusor.h"

#include "core/cloud/point_cloud.h"

namespace strata {

// The cloud without returns of range 0, at (0, 0, 0) or where the sensor stood; holes of the grid
// where it is organised. Counts them in `at_sensor` if it is not null. INVALID_ARGUMENT if none but
// those are finite.
absl::StatusOr<PointCloud> WithoutRangeZero(PointCloud cloud, std::size_t* at_sensor);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PARSING_RANGE_ZERO_H_
