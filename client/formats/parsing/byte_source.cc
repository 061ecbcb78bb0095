#include "client/formats/parsing/byte_source.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <ios>
#include <string>
#include <system_error>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace strata {

absl::StatusOr<ByteSource> ByteSource::Open(const std::filesystem::path& path) {
  ByteSource source;
  std::error_code error;
  source.size_ = std::filesystem::file_size(path, error);
  source.file_.open(path, std::ios::binary);
  if (error || !source.file_) return absl::UnavailableError("cannot be read");
  return source;
}

absl::Status ByteSource::Read(std::uint64_t at, std::uint64_t count, std::string& piece) {
  at = std::min(at, size_);
  count = std::min(count, size_ - at);
  if (!file_.is_open()) {
    piece =
        std::string(bytes_.substr(static_cast<std::size_t>(at), static_cast<std::size_t>(count)));
    return absl::OkStatus();
  }
  piece.resize(static_cast<std::size_t>(count));
  file_.seekg(static_cast<std::streamoff>(at));
  file_.read(piece.data(), static_cast<std::streamsize>(count));
  return file_ ? absl::OkStatus() : absl::UnavailableError("cannot be read");
}

}  // namespace strata
