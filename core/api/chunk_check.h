// What may arrive of a scan's points, the same at a client, a server and the engine.
#ifndef STRATA_CORE_API_CHUNK_CHECK_H_
#define STRATA_CORE_API_CHUNK_CHECK_H_

#include <cstdint>

#include "absl/status/status.h"

#include "core/cloud/point_cloud.h"
#include "core/world/scan.h"

namespace strata::api {

// INVALID_ARGUMENT unless `chunk` has 1 to kMaxPointsPerChunk points in exactly the columns of
// `header`, its origin at 0, all within ±1e6 m (three NaN pass in organised scans), with labels
// that may be, and with the `first` points before it no more than announced.
absl::Status CheckChunk(const PointCloud& chunk, const ScanHeader& header, std::uint64_t first);

}  // namespace strata::api

#endif  // STRATA_CORE_API_CHUNK_CHECK_H_
