// The maps of one PostgreSQL database (core/storage/FORMAT.md).
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_MAPS_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_MAPS_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/common/stop.h"
#include "core/storage/postgresql/connection_pool.h"
#include "core/storage/postgresql/map_leases.h"
#include "core/storage/postgresql/postgres_writer.h"
#include "core/storage/sqlite/database.h"
#include "core/storage/storage.h"
#include "core/world/map_info.h"

namespace strata {

struct PostgresOptions {
  // "postgresql://USER@HOST/DATABASE", or any other that libpq takes; its tables are made where
  // they lack, in the first schema of the search path.
  std::string where;
  std::size_t max_connections = 32;
  LeaseOptions lease = {};
  // false: commits and reads do not ask whether their map was taken away, and corrupt it if so. For
  // tests that must fail then.
  bool fenced = true;
};

// What a map's rows say of it, whether somebody has it open or not.
struct MapAtRest {
  MapInfo info;  // with its name
  std::uint64_t clock = 0;
  // Scans or jobs wait, or what is derived is incomplete or of another format.
  bool has_work = false;
};

// Thread-safe.
class PostgresMaps {
 public:
  // Carries out deletions that were cut short, too. The errors of Connection::Open();
  // FAILED_PRECONDITION for tables of another format.
  static absl::StatusOr<PostgresMaps> Connect(const PostgresOptions& options);

  // Sorted.
  absl::StatusOr<std::vector<std::string>> List() const;
  absl::StatusOr<bool> Has(absl::string_view name) const;
  // Whose lease has ended without having been given up: the process that had them died, say.
  absl::StatusOr<std::vector<std::string>> ListAbandoned() const;
  // Where those of `names` that are there stand, in one statement. Names must be valid
  // (ValidateName).
  absl::StatusOr<std::vector<std::pair<std::string, MapClock>>> ListClocks(
      const std::vector<std::string>& names) const;
  // All maps, a thousand a query, in no order; an error of one of them is of its rows. CANCELLED,
  // DEADLINE_EXCEEDED by `stop`.
  absl::Status Survey(
      const Stop& stop,
      absl::FunctionRef<void(absl::StatusOr<MapAtRest> map, const std::string& name)> tell) const;
  // All or nothing, its clock at `clock`. ALREADY_EXISTS.
  absl::Status Create(absl::string_view name,
                      const MapParameters& parameters,
                      absl::Time created,
                      std::uint64_t clock = 0) const;
  // NOT_FOUND; DATA_LOSS if the map's own row is damaged. Outlives this object. Others may have the
  // map open, too, and write it between two commits.
  absl::StatusOr<std::unique_ptr<MapStorage>> Open(absl::string_view name) const;
  // The same, alone: with a lease, renewed until the storage goes. UNAVAILABLE with MapOwnerOf()
  // while another process has it so. Whoever had it so before, and let its lease end, can not write
  // any more (TakenAway()), since every commit asks. A process that takes no maps (LeaseOptions) is
  // always refused so.
  absl::StatusOr<std::unique_ptr<MapStorage>> OpenAlone(absl::string_view name) const;
  // The same, while nobody has it alone: else commits are UNAVAILABLE with MapOwnerOf(). Takes no
  // lease, so that the next to have it alone still learns who had it last.
  absl::StatusOr<std::unique_ptr<MapStorage>> OpenIdle(absl::string_view name) const;
  // For scans beside whoever has it alone, whose commits they do not disturb: PutScan() is
  // RESOURCE_EXHAUSTED while `most_waiting` (at least 1) wait for integration, and UNAVAILABLE if
  // chunks of the scan are gone. UNAVAILABLE while nobody has it alone: then whoever would add
  // takes it, unless he takes no maps. NOT_FOUND.
  absl::StatusOr<std::unique_ptr<MapStorage>> OpenToAdd(absl::string_view name,
                                                        std::uint64_t most_waiting) const;
  // OK where somebody has the map alone, or will soon: it is offered to those who take maps.
  // UNAVAILABLE where none of them lives. NOT_FOUND.
  absl::Status Offer(absl::string_view name) const;
  // Those that this process has alone in which scans, jobs or edits wait, whoever added them.
  absl::StatusOr<std::vector<WaitingMap>> ListWaiting() const;
  // Servers that live now and run jobs of maps that others have: which they are (LeaseOptions),
  // however often they are started.
  absl::StatusOr<std::set<std::string>> ListWorkers() const;
  // Of all maps, those longest unchanged first.
  absl::StatusOr<std::vector<UnfinishedJob>> ListUnfinishedJobs() const;
  // For a job that is run beside whoever has the map alone: commits are taken back, TakenAway(),
  // once the job's parameter kRunBy is another than `run_by`; empty: not so. NOT_FOUND.
  absl::StatusOr<std::unique_ptr<MapStorage>> OpenToWork(absl::string_view name,
                                                         std::uint64_t job,
                                                         absl::string_view run_by) const;
  // Makes a map of a map file that nobody has open, all or nothing: of the current format and
  // closed well (FAILED_PRECONDITION). Its clock begins behind those of all maps that were removed.
  // A row is in memory at a time. ALREADY_EXISTS; DATA_LOSS for a damaged file; INVALID_ARGUMENT
  // for values that a database does not take; CANCELLED, DEADLINE_EXCEEDED by `stop`.
  absl::Status Import(absl::string_view name,
                      const std::filesystem::path& file,
                      const Stop& stop) const;
  // For reading only, whoever has it: every commit is refused. NOT_FOUND.
  absl::StatusOr<std::unique_ptr<MapStorage>> OpenToRead(absl::string_view name) const;
  // The latest clock of a map that was deleted; 0: none was.
  absl::StatusOr<std::uint64_t> RemovedClock() const;
  // UNAVAILABLE with MapOwnerOf() while another process has it alone; whoever has it open otherwise
  // can neither read nor write it any more. Its rows go after its name, so that
  // what is left when this ends with an error is deleted by the next Connect(). NOT_FOUND.
  absl::Status Delete(absl::string_view name) const;
  // The same as an edit EditKind::kDeleteMap asks for, which goes with the name: who has asked
  // carries out the rest. ABORTED where none waits any more.
  absl::Status DeleteAsAsked(absl::string_view name) const;
  // Takes the rows of maps that have no name any more, but for those that another is at.
  absl::Status FinishDeletions() const;

 private:
  PostgresMaps(std::shared_ptr<ConnectionPool> pool, const PostgresOptions& options)
      : pool_(std::move(pool)),
        leases_(std::make_shared<MapLeases>(options.where, options.lease)),
        fenced_(options.fenced) {}
  // The thousand rows behind the map with the number `last`.
  absl::StatusOr<Rows> SurveyAfter(std::int64_t last) const;
  absl::StatusOr<std::int64_t> Find(absl::string_view name) const;
  absl::StatusOr<std::unique_ptr<MapStorage>> OpenAs(const OpenedMap& map,
                                                     std::shared_ptr<MapLease> lease) const;
  absl::Status ImportRows(Connection& connection,
                          Database& file,
                          absl::string_view name,
                          const Stop& stop) const;
  absl::StatusOr<std::shared_ptr<MapLease>> TakeOver(OpenedMap& map) const;
  // In a transaction: takes name and truth of the map.
  absl::Status DeleteName(Connection& connection, std::int64_t map, absl::string_view name) const;
  absl::Status DeleteRows(std::int64_t map) const;

  std::shared_ptr<ConnectionPool> pool_;
  std::shared_ptr<MapLeases> leases_;
  bool fenced_ = true;
};

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_MAPS_H_
