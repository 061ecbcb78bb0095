#include "core/storage/postgresql/postgres_maps.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/algorithm/container.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"

#include "core/common/map_owner.h"
#include "core/common/status.h"
#include "core/storage/format.h"
#include "core/storage/postgresql/connection.h"
#include "core/storage/postgresql/connection_pool.h"
#include "core/storage/postgresql/map_copy.h"
#include "core/storage/postgresql/map_leases.h"
#include "core/storage/postgresql/postgres_reader.h"
#include "core/storage/postgresql/postgres_writer.h"
#include "core/storage/postgresql/tables.h"
#include "core/storage/rows.h"
#include "core/storage/sqlite/database.h"
#include "core/storage/sqlite/map_file.h"

namespace strata {
namespace {

// States of map_place.
constexpr int kThere = 1;
constexpr int kGoing = 2;
constexpr int kMaking = 3;  // inside a transaction only

class PostgresStorage final : public MapStorage {
 public:
  // `lease`: nullptr if others may write it, too.
  PostgresStorage(std::shared_ptr<ConnectionPool> pool,
                  const OpenedMap& map,
                  std::shared_ptr<MapLeases> leases,
                  std::shared_ptr<MapLease> lease)
      : pool_(pool),
        map_(map),
        leases_(std::move(leases)),
        lease_(std::move(lease)),
        writer_(std::move(pool), map) {}
  ~PostgresStorage() override {
    if (lease_ != nullptr) leases_->GiveUp(*lease_);
  }
  PostgresStorage(const PostgresStorage&) = delete;
  PostgresStorage& operator=(const PostgresStorage&) = delete;

  absl::StatusOr<std::unique_ptr<StorageReader>> NewReader() override {
    return std::make_unique<PostgresReader>(pool_, map_.number, map_.fenced ? lease_ : nullptr);
  }
  StorageWriter& writer() override { return writer_; }
  absl::Status CheckInPlace() const override {
    STRATA_RETURN_IF_ERROR(CheckHeld());
    STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
    absl::StatusOr<Rows> owner =
        lease->Query("SELECT owner FROM truth_map WHERE map = $1", map_.number);
    return CheckOwner(owner, map_);
  }
  LastOwner last_owner() const override { return map_.last_owner; }
  std::int64_t number() const override { return map_.number; }
  absl::Status CheckHeld() const override {
    return lease_ == nullptr ? absl::OkStatus() : lease_->Check();
  }

 private:
  std::shared_ptr<ConnectionPool> pool_;
  OpenedMap map_;
  std::shared_ptr<MapLeases> leases_;
  std::shared_ptr<MapLease> lease_;
  PostgresWriter writer_;
};

absl::Status NoSuchMap(absl::string_view name) {
  return absl::NotFoundError(absl::StrCat("map ", name, " does not exist"));
}

absl::Status MapExists(absl::string_view name) {
  return absl::AlreadyExistsError(absl::StrCat("map ", name, " exists"));
}

// All or nothing; a connection that is left in a transaction is closed by its pool.
absl::Status InTransaction(Connection& connection, absl::FunctionRef<absl::Status()> body) {
  STRATA_RETURN_IF_ERROR(connection.Execute("BEGIN"));
  STRATA_RETURN_IF_ERROR(body());
  return connection.Execute("COMMIT");
}

absl::Status InsertMap(Connection& connection,
                       std::int64_t map,
                       const MapParameters& parameters,
                       absl::Time created,
                       std::uint64_t clock) {
  const GeodeticOrigin origin = parameters.origin.value_or(GeodeticOrigin());
  STRATA_RETURN_IF_ERROR(
      connection
          .Change("INSERT INTO truth_map (map, created_us, cell_size_m, gap_size_m, thickness_m, "
                  "sensor_sigma_m, sensor_sigma_per_metre, sensor_min_range_m, sensor_max_range_m, "
                  "keep_points, has_origin, latitude_rad, longitude_rad, altitude_m, "
                  "commit_sequence, epoch, last_constraint, oldest_epoch, fade_after, last_model, "
                  "owner, last_commit) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, "
                  "$13, $14, "
                  "$15, 1, 0, "
                  "1, $16, 0, 0, 0)",
                  map,
                  absl::ToUnixMicros(created),
                  parameters.mls.cell_size_m,
                  parameters.mls.gap_size_m,
                  parameters.mls.thickness_m,
                  parameters.sensor.sigma_m,
                  parameters.sensor.sigma_per_metre,
                  parameters.sensor.min_range_m,
                  parameters.sensor.max_range_m,
                  parameters.keep_points,
                  parameters.origin.has_value(),
                  origin.latitude_rad,
                  origin.longitude_rad,
                  origin.altitude_m,
                  clock,
                  parameters.fade_after)
          .status());
  STRATA_RETURN_IF_ERROR(
      connection
          .Change("INSERT INTO truth_epoch (map, epoch, created_us, reason, job) VALUES ($1, 1, "
                  "$2, 'created', 0)",
                  map,
                  absl::ToUnixMicros(created))
          .status());
  return connection
      .Change(
          "INSERT INTO derived_state (map, schema, tile_version, complete, changes_after) VALUES "
          "($1, $2, 0, 1, $3)",
          map,
          kDerivedVersion,
          clock)
      .status();
}

absl::Status InsertDefaultProfile(Connection& connection,
                                  std::int64_t map,
                                  const RobotProfile& profile) {
  return connection
      .Change(
          "INSERT INTO truth_profile (map, name, radius_m, height_m, max_step_m, "
          "max_slope_rad, max_gap_m, max_roughness_m) VALUES ($1, 'default', $2, $3, $4, $5, "
          "$6, $7)",
          map,
          profile.radius_m,
          profile.height_m,
          profile.max_step_m,
          profile.max_slope_rad,
          profile.max_gap_m,
          profile.max_roughness_m)
      .status();
}

// Tiles of another format than this program's are made again, as in a file.
absl::Status DropOtherDerived(StorageWriter& writer, ConnectionPool& pool, std::int64_t map) {
  {
    STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool.Take());
    STRATA_ASSIGN_OR_RETURN(
        Rows state,
        lease->Query(
            "SELECT 1 FROM derived_state WHERE map = $1 AND schema = $2", map, kDerivedVersion));
    if (state.Next()) return absl::OkStatus();
  }
  return writer.Commit(Durability::kFull, [&] { return writer.DropDerived(); });
}

}  // namespace

absl::StatusOr<PostgresMaps> PostgresMaps::Connect(const PostgresOptions& options) {
  PostgresMaps maps(ConnectionPool::Make(options.where, options.max_connections), options);
  {
    STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, maps.pool_->Take());
    STRATA_RETURN_IF_ERROR(MakeTables(*lease));
    STRATA_RETURN_IF_ERROR(maps.leases_->Announce(*lease));
  }
  STRATA_RETURN_IF_ERROR(maps.FinishDeletions());
  return maps;
}

absl::StatusOr<std::vector<std::string>> PostgresMaps::List() const {
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      lease->Query("SELECT name FROM map_place WHERE state = $1 ORDER BY name COLLATE \"C\"",
                   kThere));
  std::vector<std::string> names;
  while (row.Next()) names.push_back(row.Text(0));
  return names;
}

// Every table from `last` on: or else a merge of them reads all there is before it.
absl::StatusOr<Rows> PostgresMaps::SurveyAfter(std::int64_t last) const {
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  return lease->Query(
      "SELECT " STRATA_MAP_INFO_COLUMNS
      ", l.map, l.name, m.commit_sequence, d.complete = 0 OR d.schema <> $3 OR EXISTS (SELECT FROM "
      "truth_scan AS s WHERE s.map = l.map AND s.state = $4) OR EXISTS (SELECT FROM truth_job AS j "
      "WHERE j.map = l.map AND j.state < $5) FROM map_place AS l JOIN truth_map AS m ON m.map = "
      "l.map JOIN truth_profile AS p ON p.map = l.map AND p.name = 'default' JOIN derived_state AS "
      "d ON d.map = l.map WHERE l.map > $1 AND m.map > $1 AND p.map > $1 AND d.map > $1 AND "
      "l.state = "
      "$2 ORDER BY l.map LIMIT 1000",
      last,
      kThere,
      kDerivedVersion,
      static_cast<int>(ScanState::kPending),
      static_cast<int>(JobState::kSucceeded));
}

absl::Status PostgresMaps::Survey(
    const Stop& stop,
    absl::FunctionRef<void(absl::StatusOr<MapAtRest> map, const std::string& name)> tell) const {
  constexpr int kFirstColumn = 20;  // after those of STRATA_MAP_INFO_COLUMNS
  std::int64_t last = 0;
  while (true) {
    STRATA_RETURN_IF_ERROR(stop.status());
    STRATA_ASSIGN_OR_RETURN(Rows row, SurveyAfter(last));
    if (row.size() == 0) return absl::OkStatus();
    while (row.Next()) {
      last = row.Int(kFirstColumn);
      const std::string name = row.Text(kFirstColumn + 1);
      absl::StatusOr<MapInfo> info = ReadMapInfo(row);
      if (!info.ok()) {
        tell(info.status(), name);
        continue;
      }
      info->name = name;
      tell(MapAtRest{*std::move(info), row.Unsigned(kFirstColumn + 2), row.Bool(kFirstColumn + 3)},
           name);
    }
  }
}

absl::StatusOr<std::int64_t> PostgresMaps::Find(absl::string_view name) const {
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      lease->Query("SELECT map FROM map_place WHERE name = $1 AND state = $2", name, kThere));
  if (!row.Next()) return NoSuchMap(name);
  return row.Int(0);
}

absl::StatusOr<bool> PostgresMaps::Has(absl::string_view name) const {
  const absl::Status found = Find(name).status();
  if (absl::IsNotFound(found)) return false;
  STRATA_RETURN_IF_ERROR(found);
  return true;
}

absl::StatusOr<std::vector<std::string>> PostgresMaps::ListAbandoned() const {
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      lease->Query("SELECT p.name FROM map_lease AS l JOIN map_place AS p ON p.map = l.map WHERE "
                   "l.expires <= clock_timestamp() AND p.state = $1",
                   kThere));
  std::vector<std::string> names;
  while (row.Next()) names.emplace_back(row.Text(0));
  return names;
}

absl::Status PostgresMaps::Create(absl::string_view name,
                                  const MapParameters& parameters,
                                  absl::Time created,
                                  std::uint64_t clock) const {
  STRATA_RETURN_IF_ERROR(ValidateMapParameters(parameters));
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  return InTransaction(*lease, [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(
        Rows place,
        lease->Query("INSERT INTO map_place (name, state) VALUES ($1, $2) ON CONFLICT DO NOTHING "
                     "RETURNING map",
                     name,
                     kThere));
    if (!place.Next()) return MapExists(name);
    const std::int64_t map = place.Int(0);
    STRATA_RETURN_IF_ERROR(InsertMap(*lease, map, parameters, created, clock));
    return InsertDefaultProfile(*lease, map, parameters.default_profile);
  });
}

absl::StatusOr<std::unique_ptr<MapStorage>> PostgresMaps::OpenAs(
    const OpenedMap& map, std::shared_ptr<MapLease> lease) const {
  auto storage = std::make_unique<PostgresStorage>(pool_, map, leases_, std::move(lease));
  StorageWriter& writer = storage->writer();
  STRATA_RETURN_IF_ERROR(Annotate(DropOtherDerived(writer, *pool_, map.number), map.name));
  STRATA_RETURN_IF_ERROR(Annotate(writer.reader().GetMapInfo().status(), map.name));
  return storage;
}

absl::StatusOr<std::unique_ptr<MapStorage>> PostgresMaps::Open(absl::string_view name) const {
  STRATA_ASSIGN_OR_RETURN(const std::int64_t number, Find(name));
  return OpenAs({.number = number, .name = std::string(name)}, nullptr);
}

absl::StatusOr<std::unique_ptr<MapStorage>> PostgresMaps::OpenIdle(absl::string_view name) const {
  STRATA_ASSIGN_OR_RETURN(const std::int64_t number, Find(name));
  {
    STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
    STRATA_RETURN_IF_ERROR(CheckNobodyHas(*lease, number, name));
  }
  return OpenAs({.number = number, .name = std::string(name), .idle = true}, nullptr);
}

absl::StatusOr<std::unique_ptr<MapStorage>> PostgresMaps::OpenToAdd(
    absl::string_view name, std::uint64_t most_waiting) const {
  STRATA_ASSIGN_OR_RETURN(const std::int64_t number, Find(name));
  {
    STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
    const bool takes = leases_->takes_maps();
    const absl::Status held =
        takes ? CheckNobodyHas(*lease, number, name) : leases_->Offer(*lease, number, name);
    if (takes && held.ok()) return absl::UnavailableError(absl::StrCat("nobody has map ", name));
    if (!held.ok() && !MapOwnerOf(held).has_value()) return held;
  }
  OpenedMap map{.number = number, .name = std::string(name), .beside = most_waiting};
  map.patience = std::max(leases_->time(), absl::Seconds(1));
  return std::make_unique<PostgresStorage>(pool_, map, leases_, nullptr);
}

absl::StatusOr<std::vector<WaitingMap>> PostgresMaps::ListWaiting() const {
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      lease->Query(
          "SELECT * FROM (SELECT p.name, EXISTS (SELECT FROM truth_scan AS s WHERE s.map "
          "= l.map AND s.state = $3) AS scans, EXISTS (SELECT FROM truth_job AS j WHERE "
          "j.map = l.map AND j.state = $4) AS jobs, (SELECT max(e.number) FROM map_edit AS "
          "e WHERE e.map = l.map AND e.answer IS NULL AND e.kind <> $5) AS edits, EXISTS (SELECT "
          "FROM map_edit AS e WHERE e.map = l.map AND e.answer IS NULL AND e.kind = $5) AS "
          "deletion FROM map_lease AS l JOIN map_place AS p ON p.map = l.map WHERE l.holder = $1 "
          "AND p.state = $2) AS w WHERE w.scans OR w.jobs OR w.edits > 0 OR w.deletion",
          leases_->holder(),
          kThere,
          static_cast<int>(ScanState::kPending),
          static_cast<int>(JobState::kQueued),
          static_cast<int>(EditKind::kDeleteMap)));
  std::vector<WaitingMap> waiting;
  while (row.Next()) {
    waiting.push_back({row.Text(0), row.Bool(1), row.Bool(2), row.Unsigned(3), row.Bool(4)});
  }
  return waiting;
}

absl::StatusOr<std::set<std::string>> PostgresMaps::ListWorkers() const {
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      lease->Query("SELECT holder, roles FROM map_server WHERE expires > clock_timestamp()"));
  std::set<std::string> workers;
  while (row.Next()) {
    const std::vector<std::string> roles = absl::StrSplit(row.Text(1), ',');
    if (absl::c_linear_search(roles, kWorkerRole)) workers.insert(row.Text(0));
  }
  return workers;
}

absl::StatusOr<std::vector<UnfinishedJob>> PostgresMaps::ListUnfinishedJobs() const {
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      lease->Query(
          "SELECT p.name, j.id, j.kind, j.state, coalesce(r.value, ''), EXISTS (SELECT FROM "
          "truth_job_parameter AS a WHERE a.map = j.map AND a.job = j.id AND a.name = $3) FROM "
          "truth_job AS j JOIN "
          "map_place AS p ON p.map = j.map AND p.state = $1 LEFT JOIN truth_job_parameter AS r ON "
          "r.map = j.map AND r.job = j.id AND r.name = $2 WHERE j.state < 3 ORDER BY j.updated_us",
          kThere,
          absl::string_view(kRunBy),
          absl::string_view(kAccepted)));
  std::vector<UnfinishedJob> jobs;
  while (row.Next()) {
    jobs.push_back({row.Text(0),
                    row.Unsigned(1),
                    row.Text(2),
                    static_cast<JobState>(row.Int(3)),
                    row.Text(4),
                    row.Bool(5)});
  }
  return jobs;
}

absl::StatusOr<std::unique_ptr<MapStorage>> PostgresMaps::OpenToWork(
    absl::string_view name, std::uint64_t job, absl::string_view run_by) const {
  STRATA_ASSIGN_OR_RETURN(const std::int64_t number, Find(name));
  OpenedMap map{.number = number, .name = std::string(name), .beside = 1};
  map.job = job;
  map.run_by = std::string(run_by);
  map.patience = std::max(leases_->time(), absl::Seconds(1));
  return std::make_unique<PostgresStorage>(pool_, map, leases_, nullptr);
}

absl::StatusOr<std::vector<std::pair<std::string, MapClock>>> PostgresMaps::ListClocks(
    const std::vector<std::string>& names) const {
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      lease->Query("SELECT p.name, m.commit_sequence, m.epoch, d.tile_version, d.complete FROM "
                   "map_place AS p JOIN truth_map AS m ON m.map = p.map JOIN derived_state AS d ON "
                   "d.map = p.map WHERE p.state = $2 AND p.name = ANY (string_to_array($1, '/'))",
                   absl::StrJoin(names, "/"),
                   kThere));
  std::vector<std::pair<std::string, MapClock>> clocks;
  while (row.Next()) {
    clocks.emplace_back(row.Text(0),
                        MapClock{row.Unsigned(1), row.Unsigned(2), row.Unsigned(3), row.Bool(4)});
  }
  return clocks;
}

// The name is taken last, or others who would make such a map had to wait.
absl::Status PostgresMaps::ImportRows(Connection& connection,
                                      Database& file,
                                      absl::string_view name,
                                      const Stop& stop) const {
  STRATA_RETURN_IF_ERROR(connection.Execute("SET LOCAL statement_timeout = 0"));
  STRATA_ASSIGN_OR_RETURN(
      Rows place,
      connection.Query("INSERT INTO map_place (name, state) VALUES ($1, $2) RETURNING map, (SELECT "
                       "max(removed_clock) FROM strata_format)",
                       name,
                       kMaking));
  place.Next();
  const std::uint64_t removed = place.Unsigned(1);
  STRATA_RETURN_IF_ERROR(
      CopyFileToMap(file, connection, place.Int(0), removed == 0 ? 0 : removed + 1, stop));
  STRATA_RETURN_IF_ERROR(
      connection
          .Change("UPDATE derived_state AS d SET changes_after = m.commit_sequence FROM truth_map "
                  "AS m WHERE d.map = $1 AND m.map = $1",
                  place.Int(0))
          .status());
  const absl::Status named =
      connection.Change("UPDATE map_place SET state = $2 WHERE map = $1", place.Int(0), kThere)
          .status();
  return absl::IsAlreadyExists(named) ? MapExists(name) : named;
}

absl::Status PostgresMaps::Import(absl::string_view name,
                                  const std::filesystem::path& file,
                                  const Stop& stop) const {
  STRATA_ASSIGN_OR_RETURN(const bool there, Has(name));
  if (there) return MapExists(name);
  STRATA_ASSIGN_OR_RETURN(Database database, OpenSqliteMapAtRest(file));
  STRATA_RETURN_IF_ERROR(database.CheckPages(stop));
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  return InTransaction(*lease, [&] { return ImportRows(*lease, database, name, stop); });
}

absl::Status PostgresMaps::Offer(absl::string_view name) const {
  STRATA_ASSIGN_OR_RETURN(const std::int64_t number, Find(name));
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  return leases_->Offer(*lease, number, name);
}

absl::StatusOr<std::unique_ptr<MapStorage>> PostgresMaps::OpenAlone(absl::string_view name) const {
  STRATA_ASSIGN_OR_RETURN(const std::int64_t number, Find(name));
  if (!leases_->takes_maps()) {
    STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease connection, pool_->Take());
    return leases_->Refuse(*connection, number, name);
  }
  OpenedMap map{.number = number, .name = std::string(name), .fenced = fenced_};
  map.patience = std::max(leases_->time(), absl::Seconds(1));
  STRATA_ASSIGN_OR_RETURN(std::shared_ptr<MapLease> lease, TakeOver(map));
  leases_->Hold(lease);
  return OpenAs(map, std::move(lease));
}

absl::StatusOr<std::unique_ptr<MapStorage>> PostgresMaps::OpenToRead(absl::string_view name) const {
  constexpr std::int64_t kNobody = -1;  // no token is negative
  STRATA_ASSIGN_OR_RETURN(const std::int64_t number, Find(name));
  const OpenedMap map{.number = number, .name = std::string(name), .owner = kNobody};
  return std::make_unique<PostgresStorage>(pool_, map, leases_, nullptr);
}

// The lock waits for commits of the owner before, relaxed ones too: what those have staged is there
// when the new one clears it away. The lease is locked before the map here and wherever both are.
absl::StatusOr<std::shared_ptr<MapLease>> PostgresMaps::TakeOver(OpenedMap& map) const {
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease connection, pool_->Take());
  STRATA_RETURN_IF_ERROR(leases_->CheckFree(*connection, map.number, map.name));
  std::shared_ptr<MapLease> lease;
  STRATA_RETURN_IF_ERROR(InTransaction(*connection, [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(map.last_owner, leases_->LastOwnerOf(*connection, map.number));
    STRATA_ASSIGN_OR_RETURN(lease, leases_->Take(*connection, map.number, map.name));
    map.owner = lease->token();
    STRATA_RETURN_IF_ERROR(connection->Execute("SET LOCAL lock_timeout = '3s'"));
    absl::StatusOr<Rows> row = connection->Query(
        "SELECT last_commit FROM truth_map WHERE map = $1 FOR UPDATE", map.number);
    if (absl::IsResourceExhausted(row.status())) return leases_->HeldUp(map.name);
    STRATA_RETURN_IF_ERROR(row.status());
    if (!row->Next()) return NoSuchMap(map.name);
    map.last_commit = row->Int(0);
    return connection
        ->Change("UPDATE truth_map SET owner = $2 WHERE map = $1", map.number, map.owner)
        .status();
  }));
  return lease;
}

absl::StatusOr<std::uint64_t> PostgresMaps::RemovedClock() const {
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  STRATA_ASSIGN_OR_RETURN(Rows row, lease->Query("SELECT max(removed_clock) FROM strata_format"));
  return row.Next() ? row.Unsigned(0) : 0;
}

// Whoever writes holds the map's row, so this waits for commits under way, and later ones find
// none.
absl::Status PostgresMaps::DeleteName(Connection& connection,
                                      std::int64_t map,
                                      absl::string_view name) const {
  STRATA_RETURN_IF_ERROR(leases_->Take(connection, map, name).status());
  STRATA_ASSIGN_OR_RETURN(
      const std::uint64_t taken,
      connection.Change(
          "UPDATE map_place SET state = $2 WHERE map = $1 AND state = $3", map, kGoing, kThere));
  if (taken == 0) return NoSuchMap(name);
  STRATA_RETURN_IF_ERROR(
      connection
          .Change("UPDATE strata_format SET removed_clock = greatest(removed_clock, (SELECT "
                  "commit_sequence FROM truth_map WHERE map = $1))",
                  map)
          .status());
  return connection.Change("DELETE FROM truth_map WHERE map = $1", map).status();
}

absl::Status PostgresMaps::Delete(absl::string_view name) const {
  STRATA_ASSIGN_OR_RETURN(const std::int64_t map, Find(name));
  {
    STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
    STRATA_RETURN_IF_ERROR(InTransaction(*lease, [&] { return DeleteName(*lease, map, name); }));
  }
  return DeleteRows(map);
}

absl::Status PostgresMaps::DeleteAsAsked(absl::string_view name) const {
  STRATA_ASSIGN_OR_RETURN(const std::int64_t map, Find(name));
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  return InTransaction(*lease, [&]() -> absl::Status {
    STRATA_RETURN_IF_ERROR(DeleteName(*lease, map, name));
    STRATA_ASSIGN_OR_RETURN(
        const std::uint64_t asked,
        lease->Change("DELETE FROM map_edit WHERE map = $1 AND kind = $2 AND answer IS NULL",
                      map,
                      static_cast<int>(EditKind::kDeleteMap)));
    if (asked > 0) return absl::OkStatus();
    return absl::AbortedError(absl::StrCat("the deletion of map ", name, " was withdrawn"));
  });
}

absl::Status PostgresMaps::FinishDeletions() const {
  std::vector<std::int64_t> going;
  {
    STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
    STRATA_ASSIGN_OR_RETURN(Rows rows,
                            lease->Query("SELECT map FROM map_place WHERE state = $1", kGoing));
    while (rows.Next()) going.push_back(rows.Int(0));
  }
  for (const std::int64_t map : going) STRATA_RETURN_IF_ERROR(DeleteRows(map));
  return absl::OkStatus();
}

absl::Status PostgresMaps::DeleteRows(std::int64_t map) const {
  STRATA_ASSIGN_OR_RETURN(const ConnectionPool::Lease lease, pool_->Take());
  STRATA_RETURN_IF_ERROR(lease->Execute("BEGIN; SET LOCAL statement_timeout = 0"));
  STRATA_ASSIGN_OR_RETURN(
      Rows mine,
      lease->Query("SELECT 1 FROM map_place WHERE map = $1 FOR UPDATE SKIP LOCKED", map));
  if (!mine.Next()) return lease->Execute("ROLLBACK");  // another process is at it
  for (const char* sql : DeletionsOfDerived()) {
    STRATA_RETURN_IF_ERROR(lease->Change(sql, map).status());
  }
  for (const char* sql : DeletionsOfTruth()) {
    STRATA_RETURN_IF_ERROR(lease->Change(sql, map).status());
  }
  STRATA_RETURN_IF_ERROR(lease->Change("DELETE FROM map_change WHERE map = $1", map).status());
  STRATA_RETURN_IF_ERROR(lease->Change("DELETE FROM map_edit WHERE map = $1", map).status());
  STRATA_RETURN_IF_ERROR(lease->Change("DELETE FROM derived_state WHERE map = $1", map).status());
  STRATA_RETURN_IF_ERROR(lease->Change("DELETE FROM map_lease WHERE map = $1", map).status());
  STRATA_RETURN_IF_ERROR(lease->Change("DELETE FROM map_place WHERE map = $1", map).status());
  return lease->Execute("COMMIT");
}

}  // namespace strata
