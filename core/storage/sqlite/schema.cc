#include "core/storage/sqlite/schema.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"

#include "core/common/status.h"
#include "core/storage/format.h"
#include "core/storage/sqlite/database.h"

namespace strata {
namespace {

// Migration i brings a file from user_version i to i + 1. Never edited once released.
constexpr std::array<const char*, kTruthVersion> kMigrations = {
    R"sql(
CREATE TABLE truth_map (
  id INTEGER PRIMARY KEY CHECK (id = 1),
  created_us INTEGER NOT NULL,
  cell_size_m REAL NOT NULL,
  gap_size_m REAL NOT NULL,
  thickness_m REAL NOT NULL,
  sensor_sigma_m REAL NOT NULL,
  sensor_sigma_per_metre REAL NOT NULL,
  sensor_min_range_m REAL NOT NULL,
  sensor_max_range_m REAL NOT NULL,
  keep_points INTEGER NOT NULL,
  has_origin INTEGER NOT NULL,
  latitude_rad REAL NOT NULL,
  longitude_rad REAL NOT NULL,
  altitude_m REAL NOT NULL,
  commit_sequence INTEGER NOT NULL,
  epoch INTEGER NOT NULL
) STRICT;
CREATE TABLE truth_scan (
  number INTEGER PRIMARY KEY,
  trajectory TEXT NOT NULL,
  sequence INTEGER NOT NULL,
  time_us INTEGER NOT NULL,
  header BLOB NOT NULL,
  points INTEGER NOT NULL,
  state INTEGER NOT NULL,
  upload INTEGER NOT NULL UNIQUE,
  chunks INTEGER NOT NULL,
  has_points INTEGER NOT NULL,
  point_bytes INTEGER NOT NULL,
  has_box INTEGER NOT NULL,
  min_x REAL NOT NULL, min_y REAL NOT NULL, min_z REAL NOT NULL,
  max_x REAL NOT NULL, max_y REAL NOT NULL, max_z REAL NOT NULL,
  content_hash TEXT NOT NULL,
  message TEXT NOT NULL,
  UNIQUE (trajectory, sequence)
) STRICT;
CREATE INDEX truth_scan_state ON truth_scan (state, number);
CREATE INDEX truth_scan_time ON truth_scan (time_us);
CREATE TABLE truth_chunk (
  upload INTEGER NOT NULL,
  ordinal INTEGER NOT NULL,
  bytes BLOB NOT NULL CHECK (length(bytes) <= 1048576),
  PRIMARY KEY (upload, ordinal)
) STRICT;
CREATE TABLE truth_local_map (
  scan INTEGER PRIMARY KEY,
  bytes BLOB NOT NULL
) STRICT;
CREATE TABLE truth_epoch (
  epoch INTEGER PRIMARY KEY,
  created_us INTEGER NOT NULL,
  reason TEXT NOT NULL
) STRICT;
CREATE TABLE truth_pose (
  scan INTEGER NOT NULL,
  epoch INTEGER NOT NULL,
  pose BLOB NOT NULL,
  origin INTEGER NOT NULL,
  aligned INTEGER NOT NULL,
  message TEXT NOT NULL,
  overlap REAL NOT NULL,
  rms_m REAL NOT NULL,
  iterations INTEGER NOT NULL,
  PRIMARY KEY (scan, epoch)
) STRICT, WITHOUT ROWID;
CREATE TABLE truth_constraint (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  scan_i INTEGER NOT NULL,
  scan_j INTEGER NOT NULL,
  pose BLOB NOT NULL,
  information BLOB NOT NULL,
  origin INTEGER NOT NULL,
  enabled INTEGER NOT NULL,
  note TEXT NOT NULL
) STRICT;
CREATE INDEX truth_constraint_i ON truth_constraint (scan_i);
CREATE INDEX truth_constraint_j ON truth_constraint (scan_j);
CREATE TABLE truth_profile (
  name TEXT PRIMARY KEY,
  radius_m REAL NOT NULL,
  height_m REAL NOT NULL,
  max_step_m REAL NOT NULL,
  max_slope_rad REAL NOT NULL,
  max_gap_m REAL NOT NULL,
  max_roughness_m REAL NOT NULL
) STRICT, WITHOUT ROWID;
CREATE TABLE truth_job (
  id INTEGER PRIMARY KEY,
  kind TEXT NOT NULL,
  state INTEGER NOT NULL,
  progress REAL NOT NULL,
  phase TEXT NOT NULL,
  message TEXT NOT NULL,
  created_us INTEGER NOT NULL,
  updated_us INTEGER NOT NULL
) STRICT;
CREATE TABLE truth_job_parameter (
  job INTEGER NOT NULL, name TEXT NOT NULL, value TEXT NOT NULL, PRIMARY KEY (job, name)
) STRICT, WITHOUT ROWID;
CREATE TABLE truth_job_metric (
  job INTEGER NOT NULL, name TEXT NOT NULL, value REAL NOT NULL, PRIMARY KEY (job, name)
) STRICT, WITHOUT ROWID;
)sql",
    R"sql(
ALTER TABLE truth_map ADD COLUMN last_constraint INTEGER NOT NULL DEFAULT 0;
UPDATE truth_map SET last_constraint =
  coalesce((SELECT seq FROM sqlite_sequence WHERE name = 'truth_constraint'), 0);
ALTER TABLE truth_map ADD COLUMN oldest_epoch INTEGER NOT NULL DEFAULT 1;
ALTER TABLE truth_epoch ADD COLUMN job INTEGER NOT NULL DEFAULT 0;
ALTER TABLE truth_constraint ADD COLUMN since_epoch INTEGER NOT NULL DEFAULT 1;
ALTER TABLE truth_constraint ADD COLUMN until_epoch INTEGER NOT NULL DEFAULT 4611686018427387904;
ALTER TABLE truth_constraint ADD COLUMN proposed_by INTEGER NOT NULL DEFAULT 0;
ALTER TABLE truth_constraint ADD COLUMN may_be_false INTEGER NOT NULL DEFAULT 0;
CREATE INDEX truth_constraint_proposed ON truth_constraint (proposed_by) WHERE proposed_by > 0;
CREATE TABLE truth_plane (
  id INTEGER PRIMARY KEY,
  normal_x REAL NOT NULL, normal_y REAL NOT NULL, normal_z REAL NOT NULL,
  distance REAL NOT NULL,
  kind INTEGER NOT NULL,
  from_edges INTEGER NOT NULL,
  enabled INTEGER NOT NULL,
  note TEXT NOT NULL,
  since_epoch INTEGER NOT NULL,
  until_epoch INTEGER NOT NULL,
  proposed_by INTEGER NOT NULL
) STRICT;
CREATE TABLE truth_plane_support (
  plane INTEGER NOT NULL,
  scan INTEGER NOT NULL,
  weight REAL NOT NULL,
  rms_m REAL NOT NULL,
  PRIMARY KEY (plane, scan)
) STRICT, WITHOUT ROWID;
CREATE INDEX truth_plane_support_scan ON truth_plane_support (scan);
CREATE TABLE truth_proposed_pose (
  job INTEGER NOT NULL, scan INTEGER NOT NULL, pose BLOB NOT NULL, PRIMARY KEY (job, scan)
) STRICT, WITHOUT ROWID;
ALTER TABLE truth_scan ADD COLUMN person_labels INTEGER NOT NULL DEFAULT 0;
ALTER TABLE truth_scan ADD COLUMN label_model INTEGER NOT NULL DEFAULT 0;
)sql",
    R"sql(
CREATE TABLE IF NOT EXISTS truth_label (
  scan INTEGER NOT NULL,
  origin INTEGER NOT NULL,
  piece INTEGER NOT NULL,
  bytes BLOB NOT NULL CHECK (length(bytes) <= 1048576),
  PRIMARY KEY (scan, origin, piece)
) STRICT;
CREATE TABLE IF NOT EXISTS truth_model (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  name TEXT NOT NULL UNIQUE,
  created_us INTEGER NOT NULL,
  job INTEGER NOT NULL,
  description TEXT NOT NULL,
  size_bytes INTEGER NOT NULL
) STRICT;
CREATE TABLE IF NOT EXISTS truth_model_parameter (
  model INTEGER NOT NULL, name TEXT NOT NULL, value TEXT NOT NULL, PRIMARY KEY (model, name)
) STRICT, WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS truth_model_score (
  model INTEGER NOT NULL, name TEXT NOT NULL, value REAL NOT NULL, PRIMARY KEY (model, name)
) STRICT, WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS truth_model_piece (
  model INTEGER NOT NULL,
  piece INTEGER NOT NULL,
  bytes BLOB NOT NULL CHECK (length(bytes) <= 1048576),
  PRIMARY KEY (model, piece)
) STRICT;
CREATE TABLE IF NOT EXISTS truth_class (
  id INTEGER PRIMARY KEY,
  name TEXT NOT NULL UNIQUE,
  colour INTEGER NOT NULL
) STRICT;
CREATE TABLE truth_upload (
  upload INTEGER PRIMARY KEY,
  trajectory TEXT NOT NULL,
  sequence INTEGER NOT NULL,
  content_hash TEXT NOT NULL,
  touched_us INTEGER NOT NULL
) STRICT;
ALTER TABLE truth_map ADD COLUMN fade_after INTEGER NOT NULL DEFAULT 0;
ALTER TABLE truth_scan ADD COLUMN faded_points INTEGER NOT NULL DEFAULT 0;
)sql",
};

constexpr char kDerivedTables[] = R"sql(
CREATE TABLE derived_state (
  id INTEGER PRIMARY KEY CHECK (id = 1),
  schema INTEGER NOT NULL,
  tile_version INTEGER NOT NULL,
  complete INTEGER NOT NULL
) STRICT;
CREATE TABLE derived_mls_tile (
  level INTEGER NOT NULL, x INTEGER NOT NULL, y INTEGER NOT NULL,
  version INTEGER NOT NULL,
  patches INTEGER NOT NULL,
  cells INTEGER NOT NULL,
  min_x REAL NOT NULL, min_y REAL NOT NULL, min_z REAL NOT NULL,
  max_x REAL NOT NULL, max_y REAL NOT NULL, max_z REAL NOT NULL,
  spread_weight REAL NOT NULL, spread_sum REAL NOT NULL,
  digest TEXT NOT NULL,
  bytes BLOB NOT NULL,
  PRIMARY KEY (level, x, y, version)
) STRICT;
CREATE TABLE derived_surface_tile (
  level INTEGER NOT NULL, x INTEGER NOT NULL, y INTEGER NOT NULL,
  version INTEGER NOT NULL,
  gone INTEGER NOT NULL,
  patches INTEGER NOT NULL,
  size_bytes INTEGER NOT NULL,
  bytes BLOB NOT NULL,
  PRIMARY KEY (level, x, y, version)
) STRICT;
CREATE TABLE derived_scan_view (
  scan INTEGER PRIMARY KEY, place BLOB NOT NULL, planes BLOB NOT NULL
) STRICT;
CREATE TABLE derived_scan_tile (
  scan INTEGER NOT NULL, x INTEGER NOT NULL, y INTEGER NOT NULL,
  PRIMARY KEY (scan, x, y)
) STRICT, WITHOUT ROWID;
CREATE INDEX derived_scan_tile_place ON derived_scan_tile (x, y, scan);
CREATE VIRTUAL TABLE derived_footprint USING rtree (
  scan, min_x, max_x, min_y, max_y,
  +exact_min_x, +exact_max_x, +exact_min_y, +exact_max_y
);
)sql";

// Programs that do not know of them leave their rows, which are of no use once their tiles change
// or say what epoch they are of, or drop them with all that is derived: they take no format version
// and are made where they lack. Listings of prepared tiles read the index alone.
constexpr char kLaterDerivedTables[] = R"sql(
CREATE TABLE IF NOT EXISTS derived_prepared_tile (
  x INTEGER NOT NULL, y INTEGER NOT NULL,
  made_of BLOB NOT NULL,
  bytes BLOB NOT NULL,
  PRIMARY KEY (x, y, made_of)
) STRICT;
CREATE TABLE IF NOT EXISTS derived_plane_model (
  job INTEGER NOT NULL, part INTEGER NOT NULL,
  bytes BLOB NOT NULL,
  PRIMARY KEY (job, part)
) STRICT;
CREATE TABLE IF NOT EXISTS derived_entity (
  job INTEGER NOT NULL, part INTEGER NOT NULL,
  bytes BLOB NOT NULL,
  PRIMARY KEY (job, part)
) STRICT;
CREATE TABLE IF NOT EXISTS derived_entity_scan (
  scan INTEGER NOT NULL, part INTEGER NOT NULL,
  PRIMARY KEY (scan, part)
) STRICT, WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS derived_inferred (
  job INTEGER NOT NULL, part INTEGER NOT NULL,
  kind INTEGER NOT NULL,
  bytes BLOB NOT NULL,
  PRIMARY KEY (job, part)
) STRICT;
CREATE TABLE IF NOT EXISTS derived_inferred_scan (
  scan INTEGER NOT NULL, kind INTEGER NOT NULL,
  PRIMARY KEY (scan, kind)
) STRICT, WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS derived_kind (
  id INTEGER PRIMARY KEY,
  info BLOB NOT NULL,
  shape BLOB NOT NULL CHECK (length(shape) <= 1048576)
) STRICT;
)sql";

// Programs that do not know of it leave it alone: things are sorted without it, and nothing else
// stands on it. So it takes no format version and is made where it lacks.
constexpr char kKindTable[] = R"sql(
CREATE TABLE IF NOT EXISTS truth_kind (
  id INTEGER PRIMARY KEY,
  name TEXT NOT NULL UNIQUE,
  info BLOB NOT NULL,
  shape BLOB NOT NULL CHECK (length(shape) <= 1048576)
) STRICT;
)sql";

// Neither truth nor derived: what was under way when a process died (FORMAT.md). Programs that do
// not know of it leave it alone, so it takes no format version.
constexpr char kAttemptTable[] = R"sql(
CREATE TABLE IF NOT EXISTS attempt (
  kind INTEGER NOT NULL,
  id INTEGER NOT NULL,
  deaths INTEGER NOT NULL,
  under_way INTEGER NOT NULL,
  PRIMARY KEY (kind, id)
) STRICT, WITHOUT ROWID;
)sql";

struct AddedColumn {
  const char* table;
  const char* name;
  const char* type;
};

// Version 2 grew while it was being made, without a number of its own for each step: files of its
// first days lack its last columns, and its last tables, which therefore belong to version 3. What
// they lack was only ever added, with these defaults, so that adding it now makes the same file.
absl::Status CompleteVersion2(Database& database) {
  constexpr std::array<AddedColumn, 3> kAdded = {{
      {"truth_constraint", "may_be_false", "INTEGER NOT NULL DEFAULT 0"},
      {"truth_scan", "person_labels", "INTEGER NOT NULL DEFAULT 0"},
      {"truth_scan", "label_model", "INTEGER NOT NULL DEFAULT 0"},
  }};
  STRATA_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database, "BEGIN IMMEDIATE"));
  for (const AddedColumn& column : kAdded) {
    std::int64_t found = 0;
    {
      STRATA_ASSIGN_OR_RETURN(
          Statement row,
          database.Prepare("SELECT count(*) FROM pragma_table_info(?1) WHERE name = ?2"));
      row.Bind(absl::string_view(column.table), absl::string_view(column.name));
      STRATA_RETURN_IF_ERROR(row.Step().status());
      found = row.Int(0);
    }
    if (found > 0) continue;
    STRATA_RETURN_IF_ERROR(database.Execute(
        absl::StrCat("ALTER TABLE ", column.table, " ADD COLUMN ", column.name, " ", column.type)));
  }
  return transaction.Commit();
}

absl::StatusOr<bool> HasDerivedTables(Database& database) {
  STRATA_ASSIGN_OR_RETURN(
      const std::int64_t tables,
      database.Pragma("SELECT count(*) FROM sqlite_schema WHERE name IN ('derived_state', "
                      "'derived_mls_tile', 'derived_surface_tile', 'derived_scan_tile', "
                      "'derived_footprint', 'derived_scan_view')"));
  if (tables != 6) return false;
  STRATA_ASSIGN_OR_RETURN(
      const std::int64_t schema,
      database.Pragma("SELECT coalesce(max(schema), 0) FROM derived_state WHERE id = 1"));
  return schema == kDerivedVersion;
}

}  // namespace

absl::Status Migrate(Database& database, absl::Span<const char* const> migrations) {
  STRATA_ASSIGN_OR_RETURN(const std::int64_t version, database.Pragma("PRAGMA user_version"));
  const auto newest = static_cast<std::int64_t>(migrations.size());
  if (version < 0 || version > newest) {
    return absl::FailedPreconditionError(
        absl::StrCat("format version ",
                     version,
                     " is newer than ",
                     newest,
                     ", the newest this program reads; update it"));
  }
  for (std::int64_t done = version; done < newest; ++done) {
    STRATA_ASSIGN_OR_RETURN(Transaction transaction,
                            Transaction::Begin(database, "BEGIN IMMEDIATE"));
    STRATA_RETURN_IF_ERROR(database.Execute(migrations[static_cast<std::size_t>(done)]));
    STRATA_RETURN_IF_ERROR(database.Execute(absl::StrCat("PRAGMA user_version = ", done + 1)));
    STRATA_RETURN_IF_ERROR(transaction.Commit());
  }
  return absl::OkStatus();
}

absl::Status ResetDerivedTables(Database& database) {
  std::vector<std::string> tables;
  {
    // An R*Tree drops its shadow tables itself.
    STRATA_ASSIGN_OR_RETURN(
        Statement names,
        database.Prepare("SELECT name FROM sqlite_schema WHERE type = 'table' AND "
                         "name GLOB 'derived_*' AND name NOT GLOB 'derived_footprint_*'"));
    STRATA_RETURN_IF_ERROR(ForEachRow(names, [&] {
      tables.push_back(names.Text(0));
      return absl::OkStatus();
    }));
  }
  for (const std::string& table : tables) {
    STRATA_RETURN_IF_ERROR(database.Execute(absl::StrCat("DROP TABLE \"", table, "\"")));
  }
  STRATA_RETURN_IF_ERROR(database.Execute(kDerivedTables));
  STRATA_RETURN_IF_ERROR(database.Execute(kLaterDerivedTables));
  return database.Execute(
      absl::StrCat("INSERT INTO derived_state VALUES (1, ", kDerivedVersion, ", 0, 0)"));
}

absl::Status CreateSchema(Database& database) {
  STRATA_RETURN_IF_ERROR(database.Execute("PRAGMA page_size = 8192"));
  STRATA_RETURN_IF_ERROR(
      database.Execute(absl::StrCat("PRAGMA application_id = ", kApplicationId)));
  STRATA_RETURN_IF_ERROR(database.Execute("PRAGMA journal_mode = WAL"));
  return UpgradeSchema(database);
}

absl::StatusOr<bool> HasCurrentSchema(Database& database) {
  STRATA_ASSIGN_OR_RETURN(const std::int64_t version, database.Pragma("PRAGMA user_version"));
  if (version != kTruthVersion) return false;
  // Those that were added without another version.
  STRATA_ASSIGN_OR_RETURN(const std::int64_t tables,
                          database.Pragma("SELECT count(*) FROM sqlite_schema WHERE name IN "
                                          "('attempt', 'truth_kind')"));
  if (tables != 2) return false;
  return HasDerivedTables(database);
}

absl::Status UpgradeSchema(Database& database) {
  const absl::StatusOr<std::int64_t> application = database.Pragma("PRAGMA application_id");
  if (!application.ok()) return application.status();
  if (*application != kApplicationId) {
    return absl::FailedPreconditionError(
        "not a Strata map: a database file of another application");
  }
  STRATA_ASSIGN_OR_RETURN(const std::int64_t version, database.Pragma("PRAGMA user_version"));
  if (version == 2) STRATA_RETURN_IF_ERROR(CompleteVersion2(database));
  STRATA_RETURN_IF_ERROR(Migrate(database, kMigrations));
  STRATA_RETURN_IF_ERROR(database.Execute(kAttemptTable));
  STRATA_RETURN_IF_ERROR(database.Execute(kKindTable));
  const absl::StatusOr<bool> derived = HasDerivedTables(database);
  if (derived.ok() && *derived) return database.Execute(kLaterDerivedTables);
  STRATA_ASSIGN_OR_RETURN(Transaction transaction, Transaction::Begin(database, "BEGIN IMMEDIATE"));
  STRATA_RETURN_IF_ERROR(ResetDerivedTables(database));
  return transaction.Commit();
}

}  // namespace strata
