// The planes of a scan as stored bytes: core/codec/FORMAT.md, "SPL1".
#ifndef STRATA_CORE_PLANES_SCAN_PLANES_CODEC_H_
#define STRATA_CORE_PLANES_SCAN_PLANES_CODEC_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/planes/scan_planes.h"

namespace strata {

inline constexpr std::uint16_t kScanPlanesVersion = 3;

// Exact: the same value comes back. REQUIRES: values as ExtractPlanes() gives them.
std::string EncodeScanPlanes(const ScanPlanes& planes);

// DATA_LOSS for anything that EncodeScanPlanes() did not write, UNIMPLEMENTED for a later version.
// What is accepted is finite and in its ranges, whoever wrote it.
absl::StatusOr<ScanPlanes> DecodeScanPlanes(absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_SCAN_PLANES_CODEC_H_
