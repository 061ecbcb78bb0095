// The map files of a directory, looked at without an engine.
#ifndef STRATA_CORE_ENGINE_MAP_MAP_CHECK_H_
#define STRATA_CORE_ENGINE_MAP_MAP_CHECK_H_

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/storage/postgresql/store_check.h"  // EngineOptions::store, looked at

namespace strata {

struct MapFileCheck {
  std::string name;
  std::uint64_t bytes = 0;
  std::int64_t format = 0;  // version of its truth; 0 where it cannot be read
  // OK; FAILED_PRECONDITION for another program's file or one of a newer version; DATA_LOSS naming
  // what SQLite's own check finds.
  absl::Status status;
};

// By name. Reads every page of every file and changes nothing: an older format stays what it is.
// UNAVAILABLE for a directory that cannot be read.
absl::StatusOr<std::vector<MapFileCheck>> CheckMapFiles(const std::filesystem::path& directory);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_MAP_CHECK_H_
