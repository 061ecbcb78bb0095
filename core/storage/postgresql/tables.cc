#include "core/storage/postgresql/tables.h"

#include <array>
#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/types/span.h"

#include "core/common/status.h"
#include "core/storage/postgresql/connection.h"

namespace strata {
namespace {

// Names and meanings are those of SQLite's (core/storage/sqlite/schema.cc), each key with the map
// in front. Bytes that are compressed already are kept out of the row as they are (EXTERNAL).
constexpr char kTables[] = R"sql(
CREATE TABLE map_place (
  map bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  name text NOT NULL,
  state bigint NOT NULL
);
CREATE UNIQUE INDEX map_place_name ON map_place (name) WHERE state = 1;
CREATE TABLE truth_map (
  map bigint PRIMARY KEY,
  created_us bigint NOT NULL,
  cell_size_m double precision NOT NULL,
  gap_size_m double precision NOT NULL,
  thickness_m double precision NOT NULL,
  sensor_sigma_m double precision NOT NULL,
  sensor_sigma_per_metre double precision NOT NULL,
  sensor_min_range_m double precision NOT NULL,
  sensor_max_range_m double precision NOT NULL,
  keep_points bigint NOT NULL,
  has_origin bigint NOT NULL,
  latitude_rad double precision NOT NULL,
  longitude_rad double precision NOT NULL,
  altitude_m double precision NOT NULL,
  commit_sequence bigint NOT NULL,
  epoch bigint NOT NULL,
  last_constraint bigint NOT NULL,
  oldest_epoch bigint NOT NULL,
  fade_after bigint NOT NULL,
  last_model bigint NOT NULL,
  owner bigint NOT NULL,
  last_commit bigint NOT NULL
) WITH (fillfactor = 50);
CREATE TABLE truth_scan (
  map bigint NOT NULL, number bigint NOT NULL,
  trajectory text NOT NULL,
  sequence bigint NOT NULL,
  time_us bigint NOT NULL,
  header bytea NOT NULL,
  points bigint NOT NULL,
  state bigint NOT NULL,
  upload bigint NOT NULL,
  chunks bigint NOT NULL,
  has_points bigint NOT NULL,
  point_bytes bigint NOT NULL,
  has_box bigint NOT NULL,
  min_x double precision NOT NULL, min_y double precision NOT NULL, min_z double precision NOT NULL,
  max_x double precision NOT NULL, max_y double precision NOT NULL, max_z double precision NOT NULL,
  content_hash text NOT NULL,
  message text NOT NULL,
  person_labels bigint NOT NULL DEFAULT 0,
  label_model bigint NOT NULL DEFAULT 0,
  faded_points bigint NOT NULL DEFAULT 0,
  PRIMARY KEY (map, number),
  UNIQUE (map, trajectory, sequence),
  UNIQUE (map, upload)
);
CREATE INDEX truth_scan_state ON truth_scan (map, state, number);
CREATE INDEX truth_scan_time ON truth_scan (map, time_us);
CREATE TABLE truth_chunk (
  map bigint NOT NULL, upload bigint NOT NULL, ordinal bigint NOT NULL,
  bytes bytea NOT NULL CHECK (length(bytes) <= 1048576),
  PRIMARY KEY (map, upload, ordinal)
);
ALTER TABLE truth_chunk ALTER bytes SET STORAGE EXTERNAL;
CREATE TABLE truth_upload (
  map bigint NOT NULL, upload bigint NOT NULL,
  trajectory text NOT NULL,
  sequence bigint NOT NULL,
  content_hash text NOT NULL,
  touched_us bigint NOT NULL,
  PRIMARY KEY (map, upload)
);
CREATE TABLE truth_local_map (
  map bigint NOT NULL, scan bigint NOT NULL, bytes bytea NOT NULL, PRIMARY KEY (map, scan)
);
ALTER TABLE truth_local_map ALTER bytes SET STORAGE EXTERNAL;
CREATE TABLE truth_epoch (
  map bigint NOT NULL, epoch bigint NOT NULL,
  created_us bigint NOT NULL,
  reason text NOT NULL,
  job bigint NOT NULL DEFAULT 0,
  PRIMARY KEY (map, epoch)
);
CREATE TABLE truth_pose (
  map bigint NOT NULL, scan bigint NOT NULL, epoch bigint NOT NULL,
  pose bytea NOT NULL,
  origin bigint NOT NULL,
  aligned bigint NOT NULL,
  message text NOT NULL,
  overlap double precision NOT NULL,
  rms_m double precision NOT NULL,
  iterations bigint NOT NULL,
  PRIMARY KEY (map, scan, epoch)
);
CREATE INDEX truth_pose_epoch ON truth_pose (map, epoch);
CREATE TABLE truth_constraint (
  map bigint NOT NULL, id bigint NOT NULL,
  scan_i bigint NOT NULL,
  scan_j bigint NOT NULL,
  pose bytea NOT NULL,
  information bytea NOT NULL,
  origin bigint NOT NULL,
  enabled bigint NOT NULL,
  note text NOT NULL,
  since_epoch bigint NOT NULL,
  until_epoch bigint NOT NULL DEFAULT 4611686018427387904,
  proposed_by bigint NOT NULL,
  may_be_false bigint NOT NULL,
  PRIMARY KEY (map, id)
);
CREATE INDEX truth_constraint_i ON truth_constraint (map, scan_i);
CREATE INDEX truth_constraint_j ON truth_constraint (map, scan_j);
CREATE INDEX truth_constraint_proposed ON truth_constraint (map, proposed_by) WHERE proposed_by > 0;
CREATE TABLE truth_plane (
  map bigint NOT NULL, id bigint NOT NULL,
  normal_x double precision NOT NULL,
  normal_y double precision NOT NULL,
  normal_z double precision NOT NULL,
  distance double precision NOT NULL,
  kind bigint NOT NULL,
  from_edges bigint NOT NULL,
  enabled bigint NOT NULL,
  note text NOT NULL,
  since_epoch bigint NOT NULL,
  until_epoch bigint NOT NULL,
  proposed_by bigint NOT NULL,
  PRIMARY KEY (map, id)
);
CREATE TABLE truth_plane_support (
  map bigint NOT NULL, plane bigint NOT NULL, scan bigint NOT NULL,
  weight double precision NOT NULL,
  rms_m double precision NOT NULL,
  PRIMARY KEY (map, plane, scan)
);
CREATE INDEX truth_plane_support_scan ON truth_plane_support (map, scan);
CREATE TABLE truth_proposed_pose (
  map bigint NOT NULL, job bigint NOT NULL, scan bigint NOT NULL, pose bytea NOT NULL,
  PRIMARY KEY (map, job, scan)
);
CREATE TABLE truth_profile (
  map bigint NOT NULL, name text NOT NULL,
  radius_m double precision NOT NULL,
  height_m double precision NOT NULL,
  max_step_m double precision NOT NULL,
  max_slope_rad double precision NOT NULL,
  max_gap_m double precision NOT NULL,
  max_roughness_m double precision NOT NULL,
  PRIMARY KEY (map, name)
);
CREATE TABLE truth_label (
  map bigint NOT NULL, scan bigint NOT NULL, origin bigint NOT NULL, piece bigint NOT NULL,
  bytes bytea NOT NULL CHECK (length(bytes) <= 1048576),
  PRIMARY KEY (map, scan, origin, piece)
);
ALTER TABLE truth_label ALTER bytes SET STORAGE EXTERNAL;
CREATE TABLE truth_model (
  map bigint NOT NULL, id bigint NOT NULL,
  name text NOT NULL,
  created_us bigint NOT NULL,
  job bigint NOT NULL,
  description text NOT NULL,
  size_bytes bigint NOT NULL,
  PRIMARY KEY (map, id),
  UNIQUE (map, name)
);
CREATE TABLE truth_model_parameter (
  map bigint NOT NULL, model bigint NOT NULL, name text NOT NULL, value text NOT NULL,
  PRIMARY KEY (map, model, name)
);
CREATE TABLE truth_model_score (
  map bigint NOT NULL, model bigint NOT NULL, name text NOT NULL, value double precision NOT NULL,
  PRIMARY KEY (map, model, name)
);
CREATE TABLE truth_model_piece (
  map bigint NOT NULL, model bigint NOT NULL, piece bigint NOT NULL,
  bytes bytea NOT NULL CHECK (length(bytes) <= 1048576),
  PRIMARY KEY (map, model, piece)
);
ALTER TABLE truth_model_piece ALTER bytes SET STORAGE EXTERNAL;
CREATE TABLE truth_class (
  map bigint NOT NULL, id bigint NOT NULL, name text NOT NULL, colour bigint NOT NULL,
  PRIMARY KEY (map, id),
  UNIQUE (map, name)
);
CREATE TABLE truth_kind (
  map bigint NOT NULL, id bigint NOT NULL, name text NOT NULL,
  info bytea NOT NULL,
  shape bytea NOT NULL CHECK (length(shape) <= 1048576),
  PRIMARY KEY (map, id),
  UNIQUE (map, name)
);
ALTER TABLE truth_kind ALTER shape SET STORAGE EXTERNAL;
CREATE TABLE truth_job (
  map bigint NOT NULL, id bigint NOT NULL,
  kind text NOT NULL,
  state bigint NOT NULL,
  progress double precision NOT NULL,
  phase text NOT NULL,
  message text NOT NULL,
  created_us bigint NOT NULL,
  updated_us bigint NOT NULL,
  PRIMARY KEY (map, id)
);
CREATE TABLE truth_job_parameter (
  map bigint NOT NULL, job bigint NOT NULL, name text NOT NULL, value text NOT NULL,
  PRIMARY KEY (map, job, name)
);
CREATE TABLE truth_job_metric (
  map bigint NOT NULL, job bigint NOT NULL, name text NOT NULL, value double precision NOT NULL,
  PRIMARY KEY (map, job, name)
);
CREATE TABLE attempt (
  map bigint NOT NULL, kind bigint NOT NULL, id bigint NOT NULL,
  deaths bigint NOT NULL,
  under_way bigint NOT NULL,
  PRIMARY KEY (map, kind, id)
);
CREATE TABLE derived_state (
  map bigint PRIMARY KEY,
  schema bigint NOT NULL,
  tile_version bigint NOT NULL,
  complete bigint NOT NULL
) WITH (fillfactor = 50);
CREATE TABLE derived_mls_tile (
  map bigint NOT NULL, level bigint NOT NULL, x bigint NOT NULL, y bigint NOT NULL,
  version bigint NOT NULL,
  patches bigint NOT NULL,
  cells bigint NOT NULL,
  min_x double precision NOT NULL, min_y double precision NOT NULL, min_z double precision NOT NULL,
  max_x double precision NOT NULL, max_y double precision NOT NULL, max_z double precision NOT NULL,
  spread_weight double precision NOT NULL, spread_sum double precision NOT NULL,
  digest text NOT NULL,
  bytes bytea NOT NULL,
  PRIMARY KEY (map, level, x, y, version)
);
ALTER TABLE derived_mls_tile ALTER bytes SET STORAGE EXTERNAL;
CREATE TABLE derived_surface_tile (
  map bigint NOT NULL, level bigint NOT NULL, x bigint NOT NULL, y bigint NOT NULL,
  version bigint NOT NULL,
  gone bigint NOT NULL,
  patches bigint NOT NULL,
  size_bytes bigint NOT NULL,
  bytes bytea NOT NULL,
  PRIMARY KEY (map, level, x, y, version)
);
ALTER TABLE derived_surface_tile ALTER bytes SET STORAGE EXTERNAL;
CREATE TABLE derived_prepared_tile (
  map bigint NOT NULL, x bigint NOT NULL, y bigint NOT NULL,
  made_of bytea NOT NULL,
  bytes bytea NOT NULL,
  PRIMARY KEY (map, x, y, made_of)
);
ALTER TABLE derived_prepared_tile ALTER bytes SET STORAGE EXTERNAL;
CREATE TABLE derived_plane_model (
  map bigint NOT NULL, job bigint NOT NULL, part bigint NOT NULL, bytes bytea NOT NULL,
  PRIMARY KEY (map, job, part)
);
CREATE TABLE derived_entity (
  map bigint NOT NULL, job bigint NOT NULL, part bigint NOT NULL, bytes bytea NOT NULL,
  PRIMARY KEY (map, job, part)
);
CREATE TABLE derived_entity_scan (
  map bigint NOT NULL, scan bigint NOT NULL, part bigint NOT NULL, PRIMARY KEY (map, scan, part)
);
CREATE TABLE derived_inferred (
  map bigint NOT NULL, job bigint NOT NULL, part bigint NOT NULL, kind bigint NOT NULL,
  bytes bytea NOT NULL,
  PRIMARY KEY (map, job, part)
);
CREATE TABLE derived_inferred_scan (
  map bigint NOT NULL, scan bigint NOT NULL, kind bigint NOT NULL, PRIMARY KEY (map, scan, kind)
);
CREATE TABLE derived_kind (
  map bigint NOT NULL, id bigint NOT NULL, info bytea NOT NULL,
  shape bytea NOT NULL CHECK (length(shape) <= 1048576),
  PRIMARY KEY (map, id)
);
CREATE TABLE derived_scan_view (
  map bigint NOT NULL, scan bigint NOT NULL, place bytea NOT NULL, planes bytea NOT NULL,
  PRIMARY KEY (map, scan)
);
CREATE TABLE derived_scan_tile (
  map bigint NOT NULL, scan bigint NOT NULL, x bigint NOT NULL, y bigint NOT NULL,
  PRIMARY KEY (map, scan, x, y)
);
CREATE INDEX derived_scan_tile_place ON derived_scan_tile (map, x, y, scan);
CREATE TABLE derived_footprint (
  map bigint NOT NULL, scan bigint NOT NULL,
  min_x double precision NOT NULL, max_x double precision NOT NULL,
  min_y double precision NOT NULL, max_y double precision NOT NULL,
  PRIMARY KEY (map, scan)
);
CREATE TABLE derived_scan_cell (
  map bigint NOT NULL, wide bigint NOT NULL, cx bigint NOT NULL, cy bigint NOT NULL,
  scan bigint NOT NULL,
  PRIMARY KEY (map, wide, cx, cy, scan)
);
CREATE INDEX derived_scan_cell_scan ON derived_scan_cell (map, scan);
)sql";

// Since version 2: who has which map. Small, changed all the time, looked up by map.
constexpr char kLeases[] = R"sql(
CREATE TABLE map_lease (
  map bigint PRIMARY KEY,
  token bigint NOT NULL,
  holder text NOT NULL,
  server text NOT NULL,
  expires timestamptz NOT NULL
) WITH (fillfactor = 50);
)sql";

// Since version 3: what changed, for those who watch a map at a server that has not got it. All
// changes after `changes_after` are there; of tables of before, and where nobody has said so, none.
constexpr char kChanges[] = R"sql(
CREATE TABLE map_change (
  map bigint NOT NULL, at bigint NOT NULL, n bigint NOT NULL,
  made timestamptz NOT NULL DEFAULT clock_timestamp(),
  trajectory text NOT NULL,
  sequence bigint NOT NULL,
  x bigint NOT NULL, y bigint NOT NULL,
  version bigint NOT NULL,
  gone bigint NOT NULL,
  inferred bigint NOT NULL,
  PRIMARY KEY (map, at, n)
);
ALTER TABLE derived_state ADD COLUMN changes_after bigint NOT NULL DEFAULT 9223372036854775807;
UPDATE derived_state AS d SET changes_after = m.commit_sequence FROM truth_map AS m WHERE m.map = d.map;
)sql";

// Since version 4: edits that wait for who has the map, and his answers, which somebody waits for.
constexpr char kEdits[] = R"sql(
CREATE TABLE map_edit (
  map bigint NOT NULL, number bigint GENERATED ALWAYS AS IDENTITY,
  made timestamptz NOT NULL DEFAULT clock_timestamp(),
  kind bigint NOT NULL,
  trajectory text NOT NULL,
  sequence bigint NOT NULL,
  value bytea NOT NULL,
  begun bigint NOT NULL DEFAULT 0,
  answer bytea,
  PRIMARY KEY (map, number)
);
)sql";

// Since version 5: servers that live, and what they do (a holder is that of map_lease); and how
// jobs are found that wait for them.
constexpr char kServers[] = R"sql(
CREATE TABLE map_server (
  holder text PRIMARY KEY,
  server text NOT NULL,
  roles text NOT NULL,
  expires timestamptz NOT NULL
) WITH (fillfactor = 50);
CREATE INDEX truth_job_unfinished ON truth_job (map, id) WHERE state < 3;
)sql";

constexpr std::array<const char*, 13> kDerived = {
    "DELETE FROM derived_mls_tile WHERE map = $1",
    "DELETE FROM derived_surface_tile WHERE map = $1",
    "DELETE FROM derived_prepared_tile WHERE map = $1",
    "DELETE FROM derived_plane_model WHERE map = $1",
    "DELETE FROM derived_entity WHERE map = $1",
    "DELETE FROM derived_entity_scan WHERE map = $1",
    "DELETE FROM derived_inferred WHERE map = $1",
    "DELETE FROM derived_inferred_scan WHERE map = $1",
    "DELETE FROM derived_kind WHERE map = $1",
    "DELETE FROM derived_scan_view WHERE map = $1",
    "DELETE FROM derived_scan_tile WHERE map = $1",
    "DELETE FROM derived_footprint WHERE map = $1",
    "DELETE FROM derived_scan_cell WHERE map = $1",
};

constexpr std::array<const char*, 22> kTruth = {
    "DELETE FROM truth_chunk WHERE map = $1",
    "DELETE FROM truth_upload WHERE map = $1",
    "DELETE FROM truth_scan WHERE map = $1",
    "DELETE FROM truth_local_map WHERE map = $1",
    "DELETE FROM truth_epoch WHERE map = $1",
    "DELETE FROM truth_pose WHERE map = $1",
    "DELETE FROM truth_constraint WHERE map = $1",
    "DELETE FROM truth_plane WHERE map = $1",
    "DELETE FROM truth_plane_support WHERE map = $1",
    "DELETE FROM truth_proposed_pose WHERE map = $1",
    "DELETE FROM truth_profile WHERE map = $1",
    "DELETE FROM truth_label WHERE map = $1",
    "DELETE FROM truth_model WHERE map = $1",
    "DELETE FROM truth_model_parameter WHERE map = $1",
    "DELETE FROM truth_model_score WHERE map = $1",
    "DELETE FROM truth_model_piece WHERE map = $1",
    "DELETE FROM truth_class WHERE map = $1",
    "DELETE FROM truth_kind WHERE map = $1",
    "DELETE FROM truth_job WHERE map = $1",
    "DELETE FROM truth_job_parameter WHERE map = $1",
    "DELETE FROM truth_job_metric WHERE map = $1",
    "DELETE FROM attempt WHERE map = $1",
};

absl::Status MakeInTransaction(Connection& connection) {
  STRATA_RETURN_IF_ERROR(connection.Execute(
      "BEGIN; CREATE TABLE IF NOT EXISTS strata_format (version bigint NOT NULL, "
      "removed_clock bigint NOT NULL); "
      "LOCK TABLE strata_format IN ACCESS EXCLUSIVE MODE"));
  STRATA_ASSIGN_OR_RETURN(Rows found,
                          connection.Query("SELECT coalesce(max(version), 0) FROM strata_format"));
  found.Next();
  const std::int64_t version = found.Int(0);
  if (version == 0) {
    STRATA_RETURN_IF_ERROR(connection.Execute(kTables));
    STRATA_RETURN_IF_ERROR(
        connection.Change("INSERT INTO strata_format (version, removed_clock) VALUES (1, 0)")
            .status());
  }
  if (version < 2) {
    STRATA_RETURN_IF_ERROR(connection.Execute(kLeases));
    STRATA_RETURN_IF_ERROR(connection.Execute("UPDATE strata_format SET version = 2"));
  }
  if (version < 3) {
    STRATA_RETURN_IF_ERROR(connection.Execute(kChanges));
    STRATA_RETURN_IF_ERROR(connection.Execute("UPDATE strata_format SET version = 3"));
  }
  if (version < 4) {
    STRATA_RETURN_IF_ERROR(connection.Execute(kEdits));
    STRATA_RETURN_IF_ERROR(connection.Execute("UPDATE strata_format SET version = 4"));
  }
  if (version < 5) {
    STRATA_RETURN_IF_ERROR(connection.Execute(kServers));
    STRATA_RETURN_IF_ERROR(connection.Execute("UPDATE strata_format SET version = 5"));
  }
  return connection.Execute("COMMIT");
}

}  // namespace

absl::StatusOr<std::int64_t> VersionOfTables(Connection& connection) {
  STRATA_ASSIGN_OR_RETURN(Rows there,
                          connection.Query("SELECT to_regclass('strata_format') IS NOT NULL"));
  if (!there.Next() || !there.Bool(0)) return 0;
  STRATA_ASSIGN_OR_RETURN(Rows found,
                          connection.Query("SELECT coalesce(max(version), 0) FROM strata_format"));
  found.Next();
  return found.Int(0);
}

absl::Status OtherFormat(std::int64_t version) {
  return absl::FailedPreconditionError(absl::StrCat("store: the tables have format ",
                                                    version,
                                                    ", this program reads ",
                                                    kDatabaseVersion,
                                                    "; update the older of the two"));
}

absl::Status MakeTables(Connection& connection) {
  constexpr int kMostAttempts = 5;
  for (int attempt = 1;; ++attempt) {
    STRATA_ASSIGN_OR_RETURN(const std::int64_t version, VersionOfTables(connection));
    if (version >= kDatabaseVersion) break;
    const absl::Status done = MakeInTransaction(connection);
    if (done.ok()) continue;
    STRATA_RETURN_IF_ERROR(connection.Execute("ROLLBACK"));
    // Another made the same table at the same moment.
    if (!absl::IsAlreadyExists(done) || attempt == kMostAttempts) return done;
  }
  STRATA_ASSIGN_OR_RETURN(const std::int64_t version, VersionOfTables(connection));
  return version == kDatabaseVersion ? absl::OkStatus() : OtherFormat(version);
}

absl::Span<const char* const> DeletionsOfDerived() { return kDerived; }

absl::Span<const char* const> DeletionsOfTruth() { return kTruth; }

}  // namespace strata
