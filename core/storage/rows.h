// Rows as records, in one place for every store: which columns a query names, in which order, and
// what is made of them. DATA_LOSS names what is damaged.
#ifndef STRATA_CORE_STORAGE_ROWS_H_
#define STRATA_CORE_STORAGE_ROWS_H_

#include <cstdint>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/mls/tile_key.h"
#include "core/storage/records.h"
#include "core/storage/row.h"
#include "core/world/classifier_info.h"
#include "core/world/epoch.h"
#include "core/world/job.h"
#include "core/world/map_class.h"
#include "core/world/map_info.h"
#include "core/world/robot_profile.h"

// A scan `s` with its pose `p`.
#define STRATA_POSED_SCAN_COLUMNS                                                             \
  "s.number, s.trajectory, s.sequence, s.header, s.state, s.upload, s.chunks, s.has_points, " \
  "s.point_bytes, s.has_box, s.min_x, s.min_y, s.min_z, s.max_x, s.max_y, s.max_z, "          \
  "s.content_hash, s.message, p.epoch IS NOT NULL, p.epoch, p.pose, p.origin, p.aligned, "    \
  "p.message, p.overlap, p.rms_m, p.iterations, s.person_labels, s.label_model, s.faded_points"
// Of truth_scan, to be held against its header.
#define STRATA_SCAN_CHECK_COLUMNS "trajectory, sequence, header, points, time_us"
// The map `m` with its default profile `p`.
#define STRATA_MAP_INFO_COLUMNS                                                           \
  "m.created_us, m.cell_size_m, m.gap_size_m, m.thickness_m, m.sensor_sigma_m, "          \
  "m.sensor_sigma_per_metre, m.sensor_min_range_m, m.sensor_max_range_m, m.keep_points, " \
  "m.has_origin, m.latitude_rad, m.longitude_rad, m.altitude_m, p.radius_m, p.height_m, " \
  "p.max_step_m, p.max_slope_rad, p.max_gap_m, p.max_roughness_m, m.fade_after"
// After the name, which is the first.
#define STRATA_PROFILE_COLUMNS \
  "name, radius_m, height_m, max_step_m, max_slope_rad, max_gap_m, max_roughness_m"
#define STRATA_JOB_COLUMNS "id, kind, state, progress, phase, message, created_us, updated_us"
// A constraint `c` of the scans `i`, which the map has not, and `j`.
#define STRATA_CONSTRAINT_COLUMNS                                                  \
  "c.id, c.scan_i, c.scan_j, c.pose, c.information, c.origin, c.enabled, c.note, " \
  "coalesce(i.trajectory, ''), coalesce(i.sequence, 0), j.trajectory, j.sequence, c.may_be_false"
#define STRATA_PLANE_COLUMNS \
  "id, normal_x, normal_y, normal_z, distance, kind, from_edges, enabled, note"
#define STRATA_CLASSIFIER_COLUMNS "id, name, created_us, job, description, size_bytes"
#define STRATA_MLS_TILE_COLUMNS                                                      \
  "level, x, y, version, patches, cells, min_x, min_y, min_z, max_x, max_y, max_z, " \
  "spread_weight, spread_sum, digest"
#define STRATA_SURFACE_TILE_COLUMNS "level, x, y, version, gone, patches, size_bytes"

namespace strata {

absl::StatusOr<PosedScan> ReadPosedScan(const Row& row);
absl::Status CheckScanColumns(const Row& row);
absl::StatusOr<MapInfo> ReadMapInfo(const Row& row);
RobotProfile ReadProfile(const Row& row, int first_column);
JobInfo ReadJob(const Row& row);
absl::StatusOr<ConstraintRecord> ReadConstraint(const Row& row);
PlaneRecord ReadPlane(const Row& row);
ClassifierInfo ReadClassifier(const Row& row);
MlsTileRow ReadMlsTile(const Row& row);
SurfaceTileRow ReadSurfaceTile(const Row& row);
// level, x, y
TileKey ReadTileKey(const Row& row);
// epoch, created_us, reason, job, poses in it, the map's epoch, its oldest_epoch
EpochInfo ReadEpoch(const Row& row);
// upload, trajectory, sequence, content_hash, touched_us, chunks, bytes
UnfinishedUpload ReadUnfinishedUpload(const Row& row);
// id, name, colour
MapClass ReadMapClass(const Row& row);
std::uint32_t ColourToColumn(const Colour& colour);
// kind, id, deaths, under_way
Attempt ReadAttempt(const Row& row);
// scan, weight, rms_m, trajectory, sequence: adds it to the plane's
void AddSupport(const Row& row, PlaneRecord& plane);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_ROWS_H_
