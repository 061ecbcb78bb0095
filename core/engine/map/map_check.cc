#include "core/engine/map/map_check.h"

#include <system_error>

#include "core/common/status.h"
#include "core/engine/map/directory.h"
#include "core/storage/sqlite/map_file_check.h"

namespace strata {

absl::StatusOr<std::vector<MapFileCheck>> CheckMapFiles(const std::filesystem::path& directory) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<std::string> names, MapDirectory::NamesIn(directory));
  std::vector<MapFileCheck> checks;
  for (const std::string& name : names) {
    const std::filesystem::path file = MapDirectory::FileIn(directory, name);
    MapFileCheck check;
    check.name = name;
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(file, error);
    if (!error) check.bytes = bytes;
    check.status = CheckSqliteMapFile(file, check.format);
    checks.push_back(std::move(check));
  }
  return checks;
}

}  // namespace strata
