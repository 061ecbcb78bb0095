// Points as bytes: pieces of scans on the wire, in the store and in a robot's spool.
#ifndef STRATA_CORE_CODEC_POINT_CODEC_H_
#define STRATA_CORE_CODEC_POINT_CODEC_H_

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/cloud/point_cloud.h"

namespace strata {

inline constexpr std::uint16_t kPointsVersion = 1;
inline constexpr std::size_t kMaxEncodedPoints = 40'000;

// Points and columns of `chunk` in the format of FORMAT.md, envelope included, lossless: at most 21
// bytes a point + 256, so below 1 MiB. Every float keeps its bits, but that all NaN become the same
// one. Origins and grid belong to the scan and are not kept. A pure function of the chunk.
// INVALID_ARGUMENT for more than kMaxEncodedPoints and for a column that is neither empty nor as
// long as the points. Thread-safe.
absl::StatusOr<std::string> EncodePoints(const PointCloud& chunk);

// The chunk, with zero origins and no grid. DATA_LOSS for bytes that are not an intact chunk,
// UNIMPLEMENTED for those of a later version. Allocates less than 4 MiB. Thread-safe.
absl::StatusOr<PointCloud> DecodePoints(absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CORE_CODEC_POINT_CODEC_H_
