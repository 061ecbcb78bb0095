// Truth about poses beyond the poses: constraints, planes, epochs, and what jobs propose.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/storage/epoch_difference.h"
#include "core/storage/rows.h"
#include "core/storage/sqlite/database.h"
#include "core/storage/sqlite/sqlite_reader.h"
#include "core/storage/sqlite/sqlite_writer.h"
#include "core/world/value_codec.h"

namespace strata {
namespace {

// Of constraints and planes: those of the current epoch, which no job proposes.
#define STRATA_IN_FORCE \
  "proposed_by = 0 AND until_epoch > (SELECT epoch FROM truth_map WHERE id = 1)"

absl::Status NoSuchConstraint(std::uint64_t id) {
  return absl::NotFoundError(absl::StrCat("constraint ", id, " does not exist"));
}

}  // namespace

absl::StatusOr<std::vector<ConstraintRecord>> SqliteReader::ListConstraints(std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT " STRATA_CONSTRAINT_COLUMNS " FROM truth_constraint AS c "
                        "LEFT JOIN truth_scan AS i ON i.number = c.scan_i "
                        "JOIN truth_scan AS j ON j.number = c.scan_j "
                        "WHERE c.since_epoch <= ?1 AND c.until_epoch > ?1 AND c.proposed_by = 0 "
                        "ORDER BY c.id"));
  row.Bind(epoch);
  std::vector<ConstraintRecord> constraints;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(ConstraintRecord record, ReadConstraint(row));
    constraints.push_back(std::move(record));
    return absl::OkStatus();
  }));
  return constraints;
}

absl::StatusOr<std::vector<PlaneRecord>> SqliteReader::ListPlanes(std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(Statement row,
                          database_.Prepare("SELECT " STRATA_PLANE_COLUMNS
                                            " FROM truth_plane WHERE since_epoch <= ?1 AND "
                                            "until_epoch > ?1 AND proposed_by = 0 ORDER BY id"));
  row.Bind(epoch);
  std::vector<PlaneRecord> planes;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&]() -> absl::Status {
    planes.push_back(ReadPlane(row));
    return ReadSupports(planes.back());
  }));
  return planes;
}

absl::Status SqliteReader::ReadSupports(PlaneRecord& record) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT p.scan, p.weight, p.rms_m, s.trajectory, s.sequence FROM "
                        "truth_plane_support AS p JOIN truth_scan AS s ON s.number = p.scan "
                        "WHERE p.plane = ?1 ORDER BY p.scan"));
  row.Bind(record.plane.id);
  return ForEachRow(row, [&] {
    AddSupport(row, record);
    return absl::OkStatus();
  });
}

absl::StatusOr<std::vector<ProposedPose>> SqliteReader::ListProposedPoses(std::uint64_t job) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT scan, pose FROM truth_proposed_pose WHERE job = ?1 ORDER BY scan"));
  row.Bind(job);
  std::vector<ProposedPose> poses;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&]() -> absl::Status {
    absl::StatusOr<Pose> pose = DecodePose(row.Bytes(1));
    if (!pose.ok()) {
      return Annotate(pose.status(), absl::StrCat("proposal of job ", job));
    }
    poses.push_back({row.Unsigned(0), *pose});
    return absl::OkStatus();
  }));
  return poses;
}

absl::StatusOr<std::vector<EpochInfo>> SqliteReader::ListEpochs() {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT e.epoch, e.created_us, e.reason, e.job, coalesce(p.decided, 0), "
                        "m.epoch, m.oldest_epoch FROM truth_map AS m, truth_epoch AS e LEFT JOIN "
                        "(SELECT epoch, count(*) AS decided FROM truth_pose GROUP BY epoch) AS p "
                        "ON p.epoch = e.epoch WHERE m.id = 1 ORDER BY e.epoch DESC"));
  std::vector<EpochInfo> epochs;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    epochs.push_back(ReadEpoch(row));
    return absl::OkStatus();
  }));
  return epochs;
}

absl::StatusOr<std::optional<EpochInfo>> SqliteReader::FindEpoch(std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("SELECT e.epoch, e.created_us, e.reason, e.job, 0, m.epoch, m.oldest_epoch "
                        "FROM truth_epoch AS e, truth_map AS m WHERE m.id = 1 AND e.epoch = ?1"));
  row.Bind(epoch);
  std::optional<EpochInfo> found;
  STRATA_RETURN_IF_ERROR(ForEachRow(row, [&] {
    found = ReadEpoch(row);
    return absl::OkStatus();
  }));
  return found;
}

absl::StatusOr<std::uint64_t> SqliteWriter::NextConstraint() {
  STRATA_ASSIGN_OR_RETURN(Statement row,
                          database_.Prepare("UPDATE truth_map SET last_constraint = "
                                            "last_constraint + 1 WHERE id = 1 "
                                            "RETURNING last_constraint"));
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return absl::DataLossError("store: the map's own row is missing");
  const std::uint64_t id = row.Unsigned(0);
  STRATA_RETURN_IF_ERROR(row.Run());
  return id;
}

absl::StatusOr<bool> SqliteWriter::Changed() {
  STRATA_ASSIGN_OR_RETURN(const std::int64_t rows, database_.Pragma("SELECT changes()"));
  return rows > 0;
}

absl::StatusOr<std::uint64_t> SqliteWriter::InsertConstraint(const ConstraintRecord& record,
                                                             std::uint64_t job) {
  const Constraint& constraint = record.constraint;
  const std::string pose = EncodePose(constraint.T_i_j);
  const std::string information = EncodeMatrix6(constraint.information);
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t id, NextConstraint());
  STRATA_RETURN_IF_ERROR(RunSql(
      "INSERT INTO truth_constraint (id, scan_i, scan_j, pose, information, origin, "
      "enabled, note, since_epoch, proposed_by, may_be_false) VALUES (?1, ?2, ?3, ?4, ?5, ?6, "
      "?7, ?8, (SELECT epoch FROM truth_map WHERE id = 1), ?9, ?10)",
      id,
      record.scan_i,
      record.scan_j,
      Blob{pose},
      Blob{information},
      static_cast<int>(constraint.origin),
      constraint.enabled,
      constraint.note,
      job,
      constraint.may_be_false));
  return id;
}

absl::StatusOr<std::uint64_t> SqliteWriter::PutConstraint(const ConstraintRecord& record) {
  return InsertConstraint(record, 0);
}

absl::Status SqliteWriter::DeleteConstraint(std::uint64_t id) {
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM truth_constraint WHERE id = ?1 AND " STRATA_IN_FORCE, id));
  STRATA_ASSIGN_OR_RETURN(const bool deleted, Changed());
  return deleted ? absl::OkStatus() : NoSuchConstraint(id);
}

absl::Status SqliteWriter::EnableConstraint(std::uint64_t id, bool enabled) {
  STRATA_RETURN_IF_ERROR(RunSql(
      "UPDATE truth_constraint SET enabled = ?2 WHERE id = ?1 AND " STRATA_IN_FORCE, id, enabled));
  STRATA_ASSIGN_OR_RETURN(const bool constraint, Changed());
  if (constraint) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(RunSql(
      "UPDATE truth_plane SET enabled = ?2 WHERE id = ?1 AND " STRATA_IN_FORCE, id, enabled));
  STRATA_ASSIGN_OR_RETURN(const bool plane, Changed());
  return plane ? absl::OkStatus() : NoSuchConstraint(id);
}

absl::Status SqliteWriter::ProposePose(std::uint64_t job, const ProposedPose& pose) {
  const std::string bytes = EncodePose(pose.T_map_scan);
  return RunSql("INSERT OR REPLACE INTO truth_proposed_pose (job, scan, pose) VALUES (?1, ?2, ?3)",
                job,
                pose.scan,
                Blob{bytes});
}

absl::Status SqliteWriter::ProposeConstraint(std::uint64_t job,
                                             const ConstraintRecord& constraint) {
  return InsertConstraint(constraint, job).status();
}

absl::Status SqliteWriter::ProposePlane(std::uint64_t job, const PlaneRecord& plane) {
  return InsertPlane(plane, job);
}

absl::Status SqliteWriter::InsertPlane(const PlaneRecord& record, std::uint64_t job) {
  const GlobalPlane& plane = record.plane;
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t id, NextConstraint());
  STRATA_RETURN_IF_ERROR(
      RunSql("INSERT INTO truth_plane (id, normal_x, normal_y, normal_z, distance, kind, "
             "from_edges, enabled, note, since_epoch, until_epoch, proposed_by) VALUES (?1, ?2, "
             "?3, ?4, ?5, ?6, ?7, ?8, ?9, (SELECT epoch FROM truth_map WHERE id = 1), "
             "4611686018427387904, ?10)",
             id,
             plane.plane.normal.x(),
             plane.plane.normal.y(),
             plane.plane.normal.z(),
             plane.plane.distance,
             static_cast<int>(plane.kind),
             plane.from_edges,
             plane.enabled,
             plane.note,
             job));
  for (std::size_t k = 0; k < record.scans.size(); ++k) {
    STRATA_RETURN_IF_ERROR(
        RunSql("INSERT INTO truth_plane_support (plane, scan, weight, rms_m) VALUES (?1, ?2, ?3, "
               "?4)",
               id,
               record.scans[k],
               plane.supports[k].weight,
               plane.supports[k].rms_m));
  }
  return absl::OkStatus();
}

absl::Status SqliteWriter::AdoptProposal(std::uint64_t job) {
  STRATA_RETURN_IF_ERROR(
      RunSql("UPDATE truth_plane SET until_epoch = (SELECT epoch FROM truth_map WHERE id = 1) "
             "WHERE " STRATA_IN_FORCE));
  for (const char* sql :
       {"UPDATE truth_plane SET proposed_by = 0, since_epoch = (SELECT epoch FROM truth_map WHERE "
        "id = 1) WHERE proposed_by = ?1",
        "UPDATE truth_constraint SET proposed_by = 0, since_epoch = (SELECT epoch FROM truth_map "
        "WHERE id = 1) WHERE proposed_by = ?1",
        "DELETE FROM truth_proposed_pose WHERE job = ?1"}) {
    STRATA_RETURN_IF_ERROR(RunSql(sql, job));
  }
  return absl::OkStatus();
}

absl::Status SqliteWriter::DiscardProposal(std::uint64_t job) {
  for (const char* sql : {"DELETE FROM truth_proposed_pose WHERE job = ?1",
                          "DELETE FROM truth_constraint WHERE proposed_by = ?1",
                          "DELETE FROM truth_plane_support WHERE plane IN (SELECT id FROM "
                          "truth_plane WHERE proposed_by = ?1)",
                          "DELETE FROM truth_plane WHERE proposed_by = ?1"}) {
    STRATA_RETURN_IF_ERROR(RunSql(sql, job));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::uint64_t> SqliteWriter::BeginEpoch(absl::string_view reason,
                                                       std::uint64_t job) {
  STRATA_ASSIGN_OR_RETURN(
      Statement row,
      database_.Prepare("UPDATE truth_map SET epoch = epoch + 1 WHERE id = 1 RETURNING epoch"));
  STRATA_ASSIGN_OR_RETURN(const bool found, row.Step());
  if (!found) return absl::DataLossError("store: the map's own row is missing");
  const std::uint64_t epoch = row.Unsigned(0);
  STRATA_RETURN_IF_ERROR(row.Run());
  STRATA_RETURN_IF_ERROR(
      RunSql("INSERT INTO truth_epoch (epoch, created_us, reason, job) VALUES (?1, ?2, ?3, ?4)",
             epoch,
             absl::ToUnixMicros(absl::Now()),
             reason,
             job));
  return epoch;
}

absl::Status SqliteWriter::RestoreConstraints(std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader_.GetClock());
  STRATA_ASSIGN_OR_RETURN(const EpochDifference difference,
                          DifferenceOfEpochs(reader_, epoch, clock.epoch));
  for (const std::uint64_t id : difference.ended_constraints) {
    STRATA_RETURN_IF_ERROR(
        RunSql("UPDATE truth_constraint SET until_epoch = ?2 WHERE id = ?1", id, clock.epoch));
  }
  for (const ConstraintRecord& record : difference.restored_constraints) {
    STRATA_RETURN_IF_ERROR(InsertConstraint(record, 0).status());
  }
  for (const std::uint64_t id : difference.ended_planes) {
    STRATA_RETURN_IF_ERROR(
        RunSql("UPDATE truth_plane SET until_epoch = ?2 WHERE id = ?1", id, clock.epoch));
  }
  for (const PlaneRecord& record : difference.restored_planes) {
    STRATA_RETURN_IF_ERROR(InsertPlane(record, 0));
  }
  return absl::OkStatus();
}

absl::Status SqliteWriter::ForgetEpochsBefore(std::uint64_t epoch) {
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM truth_pose WHERE epoch < (SELECT max(young.epoch) FROM truth_pose AS "
             "young WHERE young.scan = truth_pose.scan AND young.epoch <= ?1)",
             epoch));
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM truth_constraint WHERE until_epoch <= ?1 AND proposed_by = 0", epoch));
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM truth_plane_support WHERE plane IN (SELECT id FROM truth_plane WHERE "
             "until_epoch <= ?1 AND proposed_by = 0)",
             epoch));
  STRATA_RETURN_IF_ERROR(
      RunSql("DELETE FROM truth_plane WHERE until_epoch <= ?1 AND proposed_by = 0", epoch));
  return RunSql("UPDATE truth_map SET oldest_epoch = max(oldest_epoch, ?1) WHERE id = 1", epoch);
}

}  // namespace strata
