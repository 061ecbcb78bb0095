#include "core/storage/sqlite/file_state.h"

#include <cstdint>
#include <filesystem>
#include <optional>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <sys/stat.h>

namespace strata {

std::optional<FileState> StateOfFile(const std::filesystem::path& path) {
  struct stat found = {};
  if (::stat(path.c_str(), &found) != 0) return std::nullopt;
  return FileState{found.st_dev, found.st_ino, static_cast<std::uint64_t>(found.st_size)};
}

absl::Status TakenAway(const std::filesystem::path& file) {
  return absl::UnavailableError(absl::StrCat(
      "store: ",
      file.filename().string(),
      " was removed, replaced or cut while it was open: nothing more is taken into the "
      "map; stop the server, put the file back and start it again"));
}

}  // namespace strata
