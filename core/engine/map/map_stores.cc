#include "core/engine/map/map_stores.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/engine/map/database_stores.h"
#include "core/engine/map/directory.h"
#include "core/storage/postgresql/postgres_maps.h"
#include "core/storage/sqlite/sqlite_storage.h"
#include "core/world/names.h"

namespace strata {
namespace {

absl::StatusOr<MapOutline> ReadOutline(StorageReader& reader) {
  MapOutline outline;
  STRATA_ASSIGN_OR_RETURN(outline.info, reader.GetMapInfo());
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader.GetClock());
  outline.clock = clock.commit_sequence;
  MapNumbers& numbers = outline.numbers.emplace();
  STRATA_ASSIGN_OR_RETURN(const std::vector<JobInfo> jobs, reader.ListJobs());
  AddJobs(jobs, numbers);
  STRATA_RETURN_IF_ERROR(AddContents(reader, clock.tile_version, numbers));
  outline.has_work =
      !clock.derived_complete || numbers.scans_pending > 0 ||
      std::any_of(jobs.begin(), jobs.end(), [](const JobInfo& job) { return !IsFinal(job.state); });
  return outline;
}

class FileStores final : public MapStores {
 public:
  FileStores(const EngineOptions& options, const MapDirectory& directory)
      : options_(options), directory_(directory) {}

  absl::StatusOr<std::vector<std::string>> List() const override { return directory_.ListNames(); }
  absl::Status Survey(const Stop& stop, TellOutline tell) const override {
    STRATA_ASSIGN_OR_RETURN(const std::vector<std::string> names, List());
    for (const std::string& name : names) {
      STRATA_RETURN_IF_ERROR(stop.status());
      tell(name, OutlineOf(FileOf(name)));
    }
    return absl::OkStatus();
  }
  absl::Status Create(absl::string_view name,
                      const MapParameters& parameters,
                      absl::Time created) const override {
    return directory_.CreateFile(name, parameters, created);
  }
  absl::StatusOr<StoredMap> Open(absl::string_view name) const override {
    return OpenMapFile(FileOf(name), options_);
  }
  absl::Status CheckRemovable(absl::string_view name) const override {
    return directory_.CheckRemovable(name);
  }
  absl::Status Delete(absl::string_view name, std::uint64_t clock) const override {
    return directory_.RemoveFile(name, clock);
  }
  std::filesystem::path FileOf(absl::string_view name) const override {
    return directory_.FileOf(name);
  }

 private:
  static absl::StatusOr<MapOutline> OutlineOf(const std::filesystem::path& file) {
    STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<StorageReader> reader, ReadSqliteMapAtRest(file));
    STRATA_ASSIGN_OR_RETURN(MapOutline outline, ReadOutline(*reader));
    AddFileBytes(file, *outline.numbers);
    return outline;
  }

  const EngineOptions options_;
  const MapDirectory& directory_;
};

class PostgresStores final : public MapStores {
 public:
  explicit PostgresStores(PostgresMaps maps) : maps_(std::move(maps)) {}

  absl::StatusOr<std::vector<std::string>> List() const override {
    STRATA_ASSIGN_OR_RETURN(std::vector<std::string> names, maps_.List());
    EraseStrange(names);
    return names;
  }
  absl::Status Survey(const Stop& stop, TellOutline tell) const override {
    return maps_.Survey(stop, [&tell](absl::StatusOr<MapAtRest> map, const std::string& name) {
      if (!ValidateName("map name", name).ok()) return;
      if (!map.ok()) return tell(name, map.status());
      tell(name, MapOutline{std::move(map->info), map->clock, map->has_work, std::nullopt});
    });
  }
  absl::Status Create(absl::string_view name,
                      const MapParameters& parameters,
                      absl::Time created) const override {
    STRATA_ASSIGN_OR_RETURN(const std::uint64_t removed, maps_.RemovedClock());
    return maps_.Create(name, parameters, created, removed == 0 ? 0 : removed + 1);
  }
  absl::StatusOr<StoredMap> Open(absl::string_view name) const override {
    STRATA_ASSIGN_OR_RETURN(std::unique_ptr<MapStorage> storage, maps_.OpenAlone(name));
    return StoredMap{std::move(storage), {}};
  }
  absl::StatusOr<std::unique_ptr<MapStorage>> OpenToRead(absl::string_view name) const override {
    return maps_.OpenToRead(name);
  }
  absl::StatusOr<std::unique_ptr<MapStorage>> OpenToAdd(absl::string_view name,
                                                        std::uint64_t most_waiting) const override {
    return maps_.OpenToAdd(name, most_waiting);
  }
  absl::Status CheckTaken(absl::string_view name) const override { return maps_.Offer(name); }
  absl::StatusOr<std::vector<WaitingMap>> ListWaiting() const override {
    return maps_.ListWaiting();
  }
  absl::StatusOr<std::vector<std::pair<std::string, MapClock>>> ListClocks(
      const std::vector<std::string>& names) const override {
    return maps_.ListClocks(names);
  }
  absl::StatusOr<std::set<std::string>> ListWorkers() const override { return maps_.ListWorkers(); }
  absl::StatusOr<std::vector<UnfinishedJob>> ListUnfinishedJobs() const override {
    return maps_.ListUnfinishedJobs();
  }
  absl::StatusOr<StoredMap> OpenToWork(absl::string_view name,
                                       std::uint64_t job,
                                       absl::string_view run_by) const override {
    STRATA_ASSIGN_OR_RETURN(std::unique_ptr<MapStorage> storage,
                            maps_.OpenToWork(name, job, run_by));
    return StoredMap{std::move(storage), {}};
  }
  bool IsShared() const override { return true; }
  absl::StatusOr<bool> Has(absl::string_view name) const override { return maps_.Has(name); }
  absl::StatusOr<std::vector<std::string>> ListAbandoned() const override {
    STRATA_ASSIGN_OR_RETURN(std::vector<std::string> names, maps_.ListAbandoned());
    EraseStrange(names);
    return names;
  }
  absl::Status CheckRemovable(absl::string_view) const override { return absl::OkStatus(); }
  absl::Status Delete(absl::string_view name, std::uint64_t) const override {
    const absl::Status deleted = maps_.Delete(name);
    return absl::IsNotFound(deleted) ? absl::OkStatus() : deleted;
  }
  absl::Status DeleteAsAsked(absl::string_view name) const override {
    return maps_.DeleteAsAsked(name);
  }
  absl::Status FinishDeletions() const override { return maps_.FinishDeletions(); }
  std::filesystem::path FileOf(absl::string_view) const override { return {}; }

 private:
  // Names that others put there are no maps of ours.
  static void EraseStrange(std::vector<std::string>& names) {
    std::erase_if(names,
                  [](const std::string& name) { return !ValidateName("map name", name).ok(); });
  }

  PostgresMaps maps_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<MapStores>> OpenMapStores(const EngineOptions& options,
                                                         const MapDirectory& directory) {
  if (options.store.empty()) return std::make_unique<FileStores>(options, directory);
  STRATA_ASSIGN_OR_RETURN(const PostgresOptions database, DatabaseOf(options, directory));
  return OpenDatabaseStores(database);
}

absl::StatusOr<PostgresOptions> DatabaseOf(const EngineOptions& options,
                                           const MapDirectory& directory) {
  PostgresOptions database;
  database.where = options.store;
  STRATA_ASSIGN_OR_RETURN(database.lease.holder, directory.Identity());
  database.lease.server = options.server_name;
  database.lease.time = options.map_lease;
  database.lease.roles = RolesOf(options);
  return database;
}

absl::StatusOr<std::unique_ptr<MapStores>> OpenDatabaseStores(const PostgresOptions& options) {
  STRATA_ASSIGN_OR_RETURN(PostgresMaps maps, PostgresMaps::Connect(options));
  return std::make_unique<PostgresStores>(std::move(maps));
}

absl::StatusOr<StoredMap> OpenMapFile(const std::filesystem::path& file,
                                      const EngineOptions& options) {
  SqliteOptions sqlite;
  sqlite.max_file_bytes = options.max_map_bytes;
  STRATA_ASSIGN_OR_RETURN(std::unique_ptr<MapStorage> storage, OpenSqliteStorage(file, sqlite));
  return StoredMap{std::move(storage), file};
}

}  // namespace strata
