// Pieces of a file that is too large to be held as a whole, or of bytes that are held already.
#ifndef STRATA_CLIENT_FORMATS_PARSING_BYTE_SOURCE_H_
#define STRATA_CLIENT_FORMATS_PARSING_BYTE_SOURCE_H_

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

class ByteSource {
 public:
  // The bytes must outlive it.
  explicit ByteSource(absl::string_view bytes) : bytes_(bytes), size_(bytes.size()) {}
  // UNAVAILABLE if it cannot be read.
  static absl::StatusOr<ByteSource> Open(const std::filesystem::path& path);

  std::uint64_t size() const { return size_; }

  // `piece` becomes what is there: fewer bytes than `count` where the end comes first. UNAVAILABLE
  // if the disk fails.
  absl::Status Read(std::uint64_t at, std::uint64_t count, std::string& piece);

 private:
  ByteSource() = default;

  absl::string_view bytes_;
  std::ifstream file_;  // open, if it is a file
  std::uint64_t size_ = 0;
};

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_PARSING_BYTE_SOURCE_H_
