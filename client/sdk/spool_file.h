// One scan as a file of a spool.
#ifndef STRATA_CLIENT_SDK_SPOOL_FILE_H_
#define STRATA_CLIENT_SDK_SPOOL_FILE_H_

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/cloud/point_cloud.h"
#include "core/world/scan.h"

namespace strata::sdk {

// Whose points a file has; the header announces their content_hash.
struct SpooledScan {
  std::string map;
  ScanHeader header;
};

// Numbers are little-endian: "STRSPOOL"; version (32 bits: 1); length of the head (32 bits); the
// head: map, trajectory and content_hash (each 16 bits of length before it), sequence (64 bits),
// scan header (core/world/value_codec); XXH3-64 of all before; then for each piece its length (32
// bits) and core/codec's point bytes.
// INVALID_ARGUMENT for columns of `cloud` that do not fit its points. REQUIRES: `cloud` is what the
// header says.
absl::StatusOr<std::string> EncodeSpoolFile(const SpooledScan& scan, const PointCloud& cloud);

// Reads piece by piece. Its input is hostile: DATA_LOSS for whatever EncodeSpoolFile() would not
// have written, memory is bounded.
class SpoolFileReader {
 public:
  // Reads the head. NOT_FOUND without a file.
  static absl::StatusOr<SpoolFileReader> Open(const std::filesystem::path& file);

  const SpooledScan& scan() const { return scan_; }
  // The next points; nullopt once all have come.
  absl::StatusOr<std::optional<PointCloud>> Next();

 private:
  explicit SpoolFileReader(std::ifstream stream) : stream_(std::move(stream)) {}
  absl::Status ReadHead();

  std::ifstream stream_;
  SpooledScan scan_;
  std::uint64_t points_ = 0;  // read
};

}  // namespace strata::sdk

#endif  // STRATA_CLIENT_SDK_SPOOL_FILE_H_
