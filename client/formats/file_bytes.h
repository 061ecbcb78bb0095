// Whole files in memory.
#ifndef STRATA_CLIENT_FORMATS_FILE_BYTES_H_
#define STRATA_CLIENT_FORMATS_FILE_BYTES_H_

#include <filesystem>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace strata {

// NOT_FOUND if there is no such file, INVALID_ARGUMENT for a folder. Messages name the file.
absl::Status CheckIsFile(const std::filesystem::path& path);

// As CheckIsFile; RESOURCE_EXHAUSTED beyond 16
// GiB, UNAVAILABLE if it cannot be read. Messages name the file.
absl::StatusOr<std::string> ReadFileBytes(const std::filesystem::path& path);

// Replaces the file as a whole: a reader sees the old bytes or the new ones, whatever happens in
// between. What is no regular file (/dev/stdout, a pipe) is written into. FAILED_PRECONDITION,
// naming the file and the reason, if that fails: UNAVAILABLE is a server's.
absl::Status WriteFileBytes(const std::filesystem::path& path, absl::string_view bytes);

}  // namespace strata

#endif  // STRATA_CLIENT_FORMATS_FILE_BYTES_H_
