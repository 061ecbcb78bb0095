// The tables of a map as both stores have them, column by column: what is copied between them.
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_COPIED_TABLES_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_COPIED_TABLES_H_

#include <array>

namespace strata {

// A letter a column: i(nteger), r(eal), t(ext), b(ytes).
struct CopiedTable {
  const char* name;
  const char* select;  // of the database; $1 is the map
  const char* insert;  // into a file
  const char* read;    // of a file
  const char* copy;    // into the database, the map first
  const char* types;   // of what is read of a file
};

inline constexpr char kFootprintsOfFile[] =
    "SELECT scan, exact_min_x, exact_max_x, exact_min_y, exact_max_y FROM derived_footprint ORDER "
    "BY scan";

#define STRATA_COPIED(table, columns, marks, types, order)                     \
  {                                                                            \
    table, "SELECT " columns " FROM " table " WHERE map = $1 ORDER BY " order, \
        "INSERT INTO " table " (" columns ") VALUES (" marks ")",              \
        "SELECT " columns " FROM " table " ORDER BY " order,                   \
        "COPY " table " (map, " columns ") FROM STDIN (FORMAT binary)", types  \
  }

inline constexpr std::array<CopiedTable, 35> kCopiedTables = {{
    STRATA_COPIED("truth_scan",
                  "number, trajectory, sequence, time_us, header, points, state, upload, chunks, "
                  "has_points, point_bytes, has_box, min_x, min_y, min_z, max_x, max_y, max_z, "
                  "content_hash, message, person_labels, label_model, faded_points",
                  "?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16, ?17, "
                  "?18, ?19, ?20, ?21, ?22, ?23",
                  "itiibiiiiiiirrrrrrttiii",
                  "number"),
    STRATA_COPIED("truth_chunk", "upload, ordinal, bytes", "?1, ?2, ?3", "iib", "upload, ordinal"),
    STRATA_COPIED("truth_upload",
                  "upload, trajectory, sequence, content_hash, touched_us",
                  "?1, ?2, ?3, ?4, ?5",
                  "ititi",
                  "upload"),
    STRATA_COPIED("truth_local_map", "scan, bytes", "?1, ?2", "ib", "scan"),
    STRATA_COPIED(
        "truth_epoch", "epoch, created_us, reason, job", "?1, ?2, ?3, ?4", "iiti", "epoch"),
    STRATA_COPIED("truth_pose",
                  "scan, epoch, pose, origin, aligned, message, overlap, rms_m, iterations",
                  "?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9",
                  "iibiitrri",
                  "scan, epoch"),
    STRATA_COPIED("truth_constraint",
                  "id, scan_i, scan_j, pose, information, origin, enabled, note, since_epoch, "
                  "until_epoch, proposed_by, may_be_false",
                  "?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12",
                  "iiibbiitiiii",
                  "id"),
    STRATA_COPIED("truth_plane",
                  "id, normal_x, normal_y, normal_z, distance, kind, from_edges, enabled, note, "
                  "since_epoch, until_epoch, proposed_by",
                  "?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12",
                  "irrrriiitiii",
                  "id"),
    STRATA_COPIED("truth_plane_support",
                  "plane, scan, weight, rms_m",
                  "?1, ?2, ?3, ?4",
                  "iirr",
                  "plane, scan"),
    STRATA_COPIED("truth_proposed_pose", "job, scan, pose", "?1, ?2, ?3", "iib", "job, scan"),
    STRATA_COPIED("truth_profile",
                  "name, radius_m, height_m, max_step_m, max_slope_rad, max_gap_m, max_roughness_m",
                  "?1, ?2, ?3, ?4, ?5, ?6, ?7",
                  "trrrrrr",
                  "name"),
    STRATA_COPIED("truth_label",
                  "scan, origin, piece, bytes",
                  "?1, ?2, ?3, ?4",
                  "iiib",
                  "scan, origin, piece"),
    STRATA_COPIED("truth_model",
                  "id, name, created_us, job, description, size_bytes",
                  "?1, ?2, ?3, ?4, ?5, ?6",
                  "itiiti",
                  "id"),
    STRATA_COPIED(
        "truth_model_parameter", "model, name, value", "?1, ?2, ?3", "itt", "model, name"),
    STRATA_COPIED("truth_model_score", "model, name, value", "?1, ?2, ?3", "itr", "model, name"),
    STRATA_COPIED("truth_model_piece", "model, piece, bytes", "?1, ?2, ?3", "iib", "model, piece"),
    STRATA_COPIED("truth_class", "id, name, colour", "?1, ?2, ?3", "iti", "id"),
    STRATA_COPIED("truth_kind", "id, name, info, shape", "?1, ?2, ?3, ?4", "itbb", "id"),
    STRATA_COPIED("truth_job",
                  "id, kind, state, progress, phase, message, created_us, updated_us",
                  "?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8",
                  "itirttii",
                  "id"),
    // A copy is run by nobody: what another server runs waits in it.
    {"truth_job_parameter",
     "SELECT job, name, value FROM truth_job_parameter WHERE map = $1 AND name <> 'run_by' ORDER "
     "BY job, name",
     "INSERT INTO truth_job_parameter (job, name, value) VALUES (?1, ?2, ?3)",
     "SELECT job, name, value FROM truth_job_parameter WHERE name <> 'run_by' ORDER BY job, name",
     "COPY truth_job_parameter (map, job, name, value) FROM STDIN (FORMAT binary)",
     "itt"},
    STRATA_COPIED("truth_job_metric", "job, name, value", "?1, ?2, ?3", "itr", "job, name"),
    STRATA_COPIED("attempt", "kind, id, deaths, under_way", "?1, ?2, ?3, ?4", "iiii", "kind, id"),
    STRATA_COPIED("derived_mls_tile",
                  "level, x, y, version, patches, cells, min_x, min_y, min_z, max_x, max_y, max_z, "
                  "spread_weight, spread_sum, digest, bytes",
                  "?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, ?14, ?15, ?16",
                  "iiiiiirrrrrrrrtb",
                  "level, x, y, version"),
    STRATA_COPIED("derived_surface_tile",
                  "level, x, y, version, gone, patches, size_bytes, bytes",
                  "?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8",
                  "iiiiiiib",
                  "level, x, y, version"),
    STRATA_COPIED(
        "derived_prepared_tile", "x, y, made_of, bytes", "?1, ?2, ?3, ?4", "iibb", "x, y, made_of"),
    STRATA_COPIED("derived_plane_model", "job, part, bytes", "?1, ?2, ?3", "iib", "job, part"),
    STRATA_COPIED("derived_entity", "job, part, bytes", "?1, ?2, ?3", "iib", "job, part"),
    STRATA_COPIED("derived_entity_scan", "scan, part", "?1, ?2", "ii", "scan, part"),
    STRATA_COPIED(
        "derived_inferred", "job, part, kind, bytes", "?1, ?2, ?3, ?4", "iiib", "job, part"),
    STRATA_COPIED("derived_inferred_scan", "scan, kind", "?1, ?2", "ii", "scan, kind"),
    STRATA_COPIED("derived_kind", "id, info, shape", "?1, ?2, ?3", "ibb", "id"),
    STRATA_COPIED("derived_scan_view", "scan, place, planes", "?1, ?2, ?3", "ibb", "scan"),
    STRATA_COPIED("derived_scan_tile", "scan, x, y", "?1, ?2, ?3", "iii", "scan, x, y"),
    {"derived_footprint",
     "SELECT scan, min_x, max_x, min_y, max_y FROM derived_footprint WHERE map = $1 ORDER BY scan",
     "INSERT INTO derived_footprint (scan, min_x, max_x, min_y, max_y, exact_min_x, exact_max_x, "
     "exact_min_y, exact_max_y) VALUES (?1, ?2, ?3, ?4, ?5, ?2, ?3, ?4, ?5)",
     kFootprintsOfFile,
     "COPY derived_footprint (map, scan, min_x, max_x, min_y, max_y) FROM STDIN (FORMAT binary)",
     "irrrr"},
    {"derived_state",
     "SELECT tile_version, complete, schema FROM derived_state WHERE map = $1",
     "UPDATE derived_state SET tile_version = ?1, complete = ?2, schema = ?3 WHERE id = 1",
     "SELECT tile_version, complete, schema FROM derived_state WHERE id = 1",
     "COPY derived_state (map, tile_version, complete, schema) FROM STDIN (FORMAT binary)",
     "iii"},
}};

// The last, so that a copy that broke off is no map. ?1 is the least that the clock becomes.
inline constexpr CopiedTable kCopiedMap = {
    "truth_map",
    "SELECT created_us, cell_size_m, gap_size_m, thickness_m, sensor_sigma_m, "
    "sensor_sigma_per_metre, sensor_min_range_m, sensor_max_range_m, keep_points, has_origin, "
    "latitude_rad, longitude_rad, altitude_m, commit_sequence, epoch, last_constraint, "
    "oldest_epoch, fade_after FROM truth_map WHERE map = $1",
    "INSERT INTO truth_map (id, created_us, cell_size_m, gap_size_m, thickness_m, sensor_sigma_m, "
    "sensor_sigma_per_metre, sensor_min_range_m, sensor_max_range_m, keep_points, has_origin, "
    "latitude_rad, longitude_rad, altitude_m, commit_sequence, epoch, last_constraint, "
    "oldest_epoch, fade_after) VALUES (1, ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, "
    "?14, ?15, ?16, ?17, ?18)",
    "SELECT created_us, cell_size_m, gap_size_m, thickness_m, sensor_sigma_m, "
    "sensor_sigma_per_metre, sensor_min_range_m, sensor_max_range_m, keep_points, has_origin, "
    "latitude_rad, longitude_rad, altitude_m, max(commit_sequence, ?1), epoch, last_constraint, "
    "oldest_epoch, fade_after, coalesce((SELECT seq FROM sqlite_sequence WHERE name = "
    "'truth_model'), 0), 0, 0 FROM truth_map WHERE id = 1",
    "COPY truth_map (map, created_us, cell_size_m, gap_size_m, thickness_m, sensor_sigma_m, "
    "sensor_sigma_per_metre, sensor_min_range_m, sensor_max_range_m, keep_points, has_origin, "
    "latitude_rad, longitude_rad, altitude_m, commit_sequence, epoch, last_constraint, "
    "oldest_epoch, fade_after, last_model, owner, last_commit) FROM STDIN (FORMAT binary)",
    "irrrrrrriirrriiiiiiii"};

#undef STRATA_COPIED

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_COPIED_TABLES_H_
