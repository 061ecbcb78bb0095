#include "core/engine/map/idle_map.h"

#include <filesystem>
#include <memory>
#include <system_error>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"
#include "core/engine/map/directory.h"
#include "core/storage/postgresql/postgres_maps.h"
#include "core/storage/sqlite/sqlite_storage.h"
#include "core/world/names.h"

namespace strata {
namespace {

using Body = absl::FunctionRef<absl::Status(StorageWriter&)>;

absl::Status Commit(MapStorage& storage, Body body) {
  StorageWriter& writer = storage.writer();
  return writer.Commit(Durability::kFull, [&] { return body(writer); });
}

absl::Status OnFile(const std::filesystem::path& directory, absl::string_view name, Body body) {
  std::error_code error;
  if (!std::filesystem::exists(MapDirectory::FileIn(directory, name), error)) {
    return absl::NotFoundError(
        absl::StrCat("map ", name, " does not exist in ", directory.string()));
  }
  STRATA_ASSIGN_OR_RETURN(const MapDirectory owned, MapDirectory::Open(directory));
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<MapStorage> storage,
                          OpenSqliteStorage(owned.FileOf(name), SqliteOptions()));
  return Commit(*storage, body);
}

absl::StatusOr<PostgresMaps> MapsOf(const MapPlace& place) {
  PostgresOptions options;
  options.where = place.store;
  return PostgresMaps::Connect(options);
}

}  // namespace

absl::Status OnIdleMap(const MapPlace& place, absl::string_view name, Body body) {
  STRATA_RETURN_IF_ERROR(ValidateName("map name", name));
  if (place.store.empty()) return OnFile(place.directory, name, body);
  STRATA_ASSIGN_OR_RETURN(const PostgresMaps maps, MapsOf(place));
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<MapStorage> storage, maps.OpenIdle(name));
  return Commit(*storage, body);
}

absl::Status ImportMap(const MapPlace& place,
                       absl::string_view name,
                       const std::filesystem::path& file,
                       const Stop& stop) {
  STRATA_RETURN_IF_ERROR(ValidateName("map name", name));
  std::error_code error;
  if (!std::filesystem::exists(file, error)) {
    return absl::NotFoundError(absl::StrCat("file ", file.string(), " is not there"));
  }
  if (!place.store.empty()) {
    STRATA_ASSIGN_OR_RETURN(const PostgresMaps maps, MapsOf(place));
    return maps.Import(name, file, stop);
  }
  STRATA_ASSIGN_OR_RETURN(const MapDirectory owned, MapDirectory::Open(place.directory));
  return owned.ImportFile(name, file, stop);
}

}  // namespace strata
