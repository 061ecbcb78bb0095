// Maps without an engine: one that no server has open is changed, or made of a map file.
#ifndef STRATA_CORE_ENGINE_MAP_IDLE_MAP_H_
#define STRATA_CORE_ENGINE_MAP_IDLE_MAP_H_

#include <filesystem>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/strings/string_view.h"

#include "core/common/stop.h"
#include "core/storage/storage.h"

namespace strata {

// As in EngineOptions: maps lie in the directory, or in the database `store` if it is not empty.
struct MapPlace {
  std::filesystem::path directory;
  std::string store = {};
};

// Runs `body` in one durable transaction on the map; in a database it may run again, as of
// StorageWriter::Commit(). NOT_FOUND. FAILED_PRECONDITION while an engine has the directory;
// UNAVAILABLE with MapOwnerOf() while one has the map of a database open.
absl::Status OnIdleMap(const MapPlace& place,
                       absl::string_view name,
                       absl::FunctionRef<absl::Status(StorageWriter&)> body);

// Makes the map `name` of `file`, all or nothing, also when the power fails, in bounded memory.
// Into a directory that no engine has (FAILED_PRECONDITION), from a file of any format that this
// program reads, or into a database, whoever uses it, from a file of the current format that
// nobody has open (FAILED_PRECONDITION). ALREADY_EXISTS; DATA_LOSS for a damaged file; CANCELLED,
// DEADLINE_EXCEEDED by `stop`.
absl::Status ImportMap(const MapPlace& place,
                       absl::string_view name,
                       const std::filesystem::path& file,
                       const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_MAP_IDLE_MAP_H_
