// Small values as stored bytes: little-endian, with a version and a checksum. Part of
// core/storage/FORMAT.md, and of what a client keeps until it is acknowledged.
#ifndef STRATA_CORE_WORLD_VALUE_CODEC_H_
#define STRATA_CORE_WORLD_VALUE_CODEC_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/geometry/pose.h"
#include "core/world/scan.h"

namespace strata {

// Every decoder: DATA_LOSS for a wrong size, version or checksum, and for values no encoder writes.
// Round trips are exact to the bit.

std::string EncodePose(const Pose& pose);
absl::StatusOr<Pose> DecodePose(absl::string_view bytes);

std::string EncodeMatrix6(const Matrix6d& matrix);
absl::StatusOr<Matrix6d> DecodeMatrix6(absl::string_view bytes);

// Without the id, which the row holds; `id` is put into the result. Time in whole microseconds; the
// announced hash is left out.
std::string EncodeScanHeader(const ScanHeader& header);
absl::StatusOr<ScanHeader> DecodeScanHeader(const ScanId& id, absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CORE_WORLD_VALUE_CODEC_H_
