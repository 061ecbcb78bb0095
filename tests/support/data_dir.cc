#include "tests/support/data_dir.h"

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include "tests/support/paths.h"

namespace strata::testing {

std::optional<std::filesystem::path> FindData(const std::string& folder) {
  const char* root = std::getenv("STRATA_DATA");
  const std::filesystem::path path =
      std::filesystem::path(root != nullptr ? root : SourcePath("../shared/data")) / folder;
  if (!std::filesystem::exists(path)) return std::nullopt;
  return path;
}

}  // namespace strata::testing
