// The envelope of everything core/codec writes: what it is, how long, and whether it is intact.
#ifndef STRATA_CORE_CODEC_BLOB_H_
#define STRATA_CORE_CODEC_BLOB_H_

#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

// Magic numbers, as their four bytes read in a hex dump.
enum class BlobKind : std::uint32_t {  // stored
  kSurfaceTile = 0x31545353,           // "SST1"
  kMlsTile = 0x31544D53,               // "SMT1"
  kPoints = 0x31545053,                // "SPT1"
  kScanPlanes = 0x314C5053,            // "SPL1"
  kClassifier = 0x314C4353,            // "SCL1"
  kLabels = 0x31424C53,                // "SLB1"
  kPlaneModel = 0x314D5053,            // "SPM1"
  kModelPlane = 0x31504D53,            // "SMP1"
  kEntities = 0x31485345,              // "ESH1"
  kEntity = 0x31544E45,                // "ENT1"
  kKindInfo = 0x31494B53,              // "SKI1"
  kKindShape = 0x31444B53,             // "SKD1"
  kKindFile = 0x31464B53,              // "SKF1"
  kInferredHead = 0x31484953,          // "SIH1"
  kInferred = 0x314E4953,              // "SIN1"
};

// Bytes that the envelope adds to a body.
inline constexpr std::size_t kBlobOverheadBytes = 20;

// Header (magic, version, oldest reader's version, body length), body, XXH3-64 of all before.
std::string SealBlob(BlobKind kind, std::uint16_t version, absl::string_view body);

// The body, a view into `bytes`. DATA_LOSS if the bytes are damaged, cut short, followed by others
// or of another kind; UNIMPLEMENTED if intact but readable only from a version after
// `reader_version`.
absl::StatusOr<absl::string_view> OpenBlob(BlobKind kind,
                                           std::uint16_t reader_version,
                                           absl::string_view bytes);

// The oldest reader's version of bytes that OpenBlob() has accepted.
std::uint16_t VersionOfBlob(absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CORE_CODEC_BLOB_H_
