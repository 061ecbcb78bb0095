#include "client/formats/file_bytes.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <unistd.h>

#include "core/common/status.h"

namespace strata {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{16} << 30;
// At a time: a processor's cache keeps them between filling with zeros and reading.
constexpr std::size_t kReadBytes = 1 << 18;

absl::Status CannotWrite(const fs::path& path, absl::string_view why) {
  return absl::FailedPreconditionError(absl::StrCat(path.string(), ": cannot be written: ", why));
}

// `path` is the name that the user knows.
absl::Status WriteInto(const fs::path& file, const fs::path& path, absl::string_view bytes) {
  errno = 0;
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  return out ? absl::OkStatus() : CannotWrite(path, std::strerror(errno));
}

}  // namespace

absl::Status CheckIsFile(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    return absl::NotFoundError(absl::StrCat(path.string(), ": no such file"));
  }
  if (!std::filesystem::is_regular_file(path, error)) {
    return absl::InvalidArgumentError(absl::StrCat(path.string(), ": not a file"));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> ReadFileBytes(const std::filesystem::path& path) {
  STRATA_RETURN_IF_ERROR(CheckIsFile(path));
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error || size > kMaxFileBytes) {
    return absl::ResourceExhaustedError(
        absl::StrCat(path.string(), ": ", size, " bytes, at most ", kMaxFileBytes, " are read"));
  }
  std::string bytes;
  bytes.reserve(size);
  std::ifstream in(path, std::ios::binary);
  while (in && bytes.size() < size) {
    const std::size_t step = std::min<std::size_t>(kReadBytes, size - bytes.size());
    bytes.resize(bytes.size() + step);
    in.read(bytes.data() + bytes.size() - step, static_cast<std::streamsize>(step));
  }
  if (!in) return absl::UnavailableError(absl::StrCat(path.string(), ": cannot be read"));
  return bytes;
}

absl::Status WriteFileBytes(const std::filesystem::path& path, absl::string_view bytes) {
  std::error_code error;
  const fs::file_status there = fs::status(path, error);
  // A device or a pipe (/dev/stdout) must stay what it is.
  if (fs::exists(there) && !fs::is_regular_file(there)) return WriteInto(path, path, bytes);
  const fs::path target = fs::exists(there) ? fs::canonical(path, error) : path;
  fs::path temporary = target;
  temporary += absl::StrCat(".", getpid(), ".part");
  absl::Status status = WriteInto(temporary, path, bytes);
  if (status.ok()) {
    if (fs::exists(there)) fs::permissions(temporary, there.permissions(), error);
    fs::rename(temporary, target, error);
    if (!error) return status;
    status = CannotWrite(path, error.message());
  }
  fs::remove(temporary, error);
  return status;
}

}  // namespace strata
