// A map file as a file: whose it is, of which format, and whether its pages are sound.
#ifndef STRATA_CORE_STORAGE_SQLITE_MAP_FILE_CHECK_H_
#define STRATA_CORE_STORAGE_SQLITE_MAP_FILE_CHECK_H_

#include <cstdint>
#include <filesystem>

#include "absl/status/status.h"

namespace strata {

// OK, FAILED_PRECONDITION for another program's file or a newer format, DATA_LOSS naming the first
// damage that SQLite finds. Reads every page and migrates nothing. `format`: the version of its
// truth as soon as it is known.
absl::Status CheckSqliteMapFile(const std::filesystem::path& file, std::int64_t& format);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_SQLITE_MAP_FILE_CHECK_H_
