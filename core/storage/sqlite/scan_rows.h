// The columns of a scan row, in one place for everything that reads one.
#ifndef STRATA_CORE_STORAGE_SQLITE_SCAN_ROWS_H_
#define STRATA_CORE_STORAGE_SQLITE_SCAN_ROWS_H_

#include "absl/status/statusor.h"

#include "core/storage/records.h"
#include "core/storage/sqlite/database.h"

// A scan `s` with its pose `p` of epoch ?1; needs a WHERE.
#define STRATA_SELECT_POSED_SCAN                                                                \
  "SELECT s.number, s.trajectory, s.sequence, s.header, s.state, s.upload, s.chunks, "          \
  "s.has_points, s.point_bytes, s.has_box, s.min_x, s.min_y, s.min_z, s.max_x, s.max_y, "       \
  "s.max_z, s.content_hash, s.message, p.epoch IS NOT NULL, p.epoch, p.pose, p.origin, "        \
  "p.aligned, p.message, p.overlap, p.rms_m, p.iterations, s.person_labels, s.label_model, "    \
  "s.faded_points FROM truth_scan AS s LEFT JOIN "                                              \
  "truth_pose AS p ON p.scan = s.number AND p.epoch = (SELECT max(epoch) FROM truth_pose AS e " \
  "WHERE e.scan = s.number AND e.epoch <= ?1) "

namespace strata {

// The row that `statement` stands on. DATA_LOSS naming the scan if its header or pose is damaged.
absl::StatusOr<PosedScan> ReadPosedScan(const Statement& statement);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_SQLITE_SCAN_ROWS_H_
