// The pages of an E57 file (ASTM E2807-11, 8): 1020 bytes and their checksum, one after the other.
#ifndef STRATA_CLIENT_FORMATS_SURVEY_E57_FILE_H_
#define STRATA_CLIENT_FORMATS_SURVEY_E57_FILE_H_

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace strata {

// A place in a file is physical, with the checksums, or logical, without them; it is logical where
// nothing else is said.
class E57File {
 public:
  // UNAVAILABLE if it cannot be read; INVALID_ARGUMENT if it does not begin as E57 files do or is
  // shorter than it says.
  static absl::StatusOr<E57File> Open(const std::filesystem::path& path);

  std::uint64_t size() const { return pages_ * kPagePayload; }
  std::uint64_t xml_at() const { return xml_at_; }
  std::uint64_t xml_bytes() const { return xml_bytes_; }

  // INVALID_ARGUMENT beyond the end or within a checksum.
  absl::StatusOr<std::uint64_t> PlaceOf(std::uint64_t physical) const;

  // `bytes` becomes what is there. INVALID_ARGUMENT beyond the end, and naming the page whose
  // checksum (CRC-32C) is not that of its bytes; UNAVAILABLE if the disk fails.
  absl::Status Read(std::uint64_t at, std::uint64_t count, std::string& bytes);

 private:
  static constexpr std::uint64_t kPageBytes = 1024;
  static constexpr std::uint64_t kPagePayload = 1020;

  explicit E57File(const std::filesystem::path& path) : file_(path, std::ios::binary) {}
  absl::Status ReadHeader();

  std::ifstream file_;
  std::uint64_t pages_ = 0;
  std::uint64_t xml_at_ = 0;
  std::uint64_t xml_bytes_ = 0;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_SURVEY_E57_FILE_H_
