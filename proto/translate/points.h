// Points of a scan between the core's arrays and the wire's packed columns.
#ifndef STRATA_PROTO_TRANSLATE_POINTS_H_
#define STRATA_PROTO_TRANSLATE_POINTS_H_

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/cloud/point_cloud.h"
#include "core/world/scan.h"
#include "strata/v1/scans.pb.h"

namespace strata::translate {

// `cloud`'s points and columns; grid and origins are the header's and stay behind.
v1::PointChunk ToProto(const PointCloud& cloud);

// INVALID_ARGUMENT unless the columns' lengths fit each other and there are 1 to
// api::kMaxPointsPerChunk points.
absl::StatusOr<PointCloud> FromProto(const v1::PointChunk& chunk);

// INVALID_ARGUMENT for a grid that does not hold as many points as announced; 0 × 0 is none.
absl::Status CheckGrid(std::uint32_t rows, std::uint32_t columns, std::uint64_t point_count);

// Takes the first `points` points out. REQUIRES: `chunk` is what ToProto() makes of more points.
void DropFirst(std::size_t points, v1::PointChunk& chunk);

// Labels as 2 bytes each, and back: INVALID_ARGUMENT for half a label.
std::string PackLabels(std::span<const std::uint16_t> labels);
absl::StatusOr<std::vector<std::uint16_t>> UnpackLabels(const std::string& bytes);

}  // namespace strata::translate

#endif  // STRATA_PROTO_TRANSLATE_POINTS_H_
