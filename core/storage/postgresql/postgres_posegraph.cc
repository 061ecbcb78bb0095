// Truth about poses: those of scans, constraints, planes, epochs, and what jobs propose.
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "core/common/status.h"
#include "core/storage/epoch_difference.h"
#include "core/storage/postgresql/postgres_reader.h"
#include "core/storage/postgresql/postgres_writer.h"
#include "core/storage/rows.h"
#include "core/world/value_codec.h"

namespace strata {
namespace {

// Of constraints and planes: those of the current epoch, which no job proposes.
#define STRATA_IN_FORCE \
  "proposed_by = 0 AND until_epoch > (SELECT epoch FROM truth_map WHERE map = $1)"

absl::Status NoSuchConstraint(std::uint64_t id) {
  return absl::NotFoundError(absl::StrCat("constraint ", id, " does not exist"));
}

}  // namespace

absl::StatusOr<std::vector<ConstraintRecord>> PostgresReader::ListConstraints(std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT " STRATA_CONSTRAINT_COLUMNS " FROM truth_constraint AS c LEFT JOIN truth_scan AS "
          "i ON i.map = c.map AND i.number = c.scan_i JOIN truth_scan AS j ON j.map = c.map AND "
          "j.number = c.scan_j WHERE c.map = $1 AND c.since_epoch <= $2 AND c.until_epoch > $2 AND "
          "c.proposed_by = 0 ORDER BY c.id",
          epoch));
  std::vector<ConstraintRecord> constraints;
  while (row.Next()) {
    STRATA_ASSIGN_OR_RETURN(ConstraintRecord record, ReadConstraint(row));
    constraints.push_back(std::move(record));
  }
  return constraints;
}

absl::StatusOr<std::vector<PlaneRecord>> PostgresReader::ListPlanes(std::uint64_t epoch) {
  std::vector<PlaneRecord> planes;
  const absl::Status listed = OneState([&]() -> absl::Status {
    STRATA_ASSIGN_OR_RETURN(
        Rows row,
        Ask("SELECT " STRATA_PLANE_COLUMNS " FROM truth_plane WHERE map = $1 AND since_epoch <= $2 "
            "AND until_epoch > $2 AND proposed_by = 0 ORDER BY id",
            epoch));
    std::map<std::uint64_t, std::size_t> by_id;
    while (row.Next()) {
      planes.push_back(ReadPlane(row));
      by_id[planes.back().plane.id] = planes.size() - 1;
    }
    STRATA_ASSIGN_OR_RETURN(
        Rows support,
        Ask("SELECT u.scan, u.weight, u.rms_m, s.trajectory, s.sequence, u.plane FROM truth_plane "
            "AS p JOIN truth_plane_support AS u ON u.map = p.map AND u.plane = p.id JOIN "
            "truth_scan AS s ON s.map = u.map AND s.number = u.scan WHERE p.map = $1 AND "
            "p.since_epoch <= $2 AND p.until_epoch > $2 AND p.proposed_by = 0 ORDER BY u.plane, "
            "u.scan",
            epoch));
    while (support.Next()) {
      const auto plane = by_id.find(support.Unsigned(5));
      if (plane != by_id.end()) AddSupport(support, planes[plane->second]);
    }
    return absl::OkStatus();
  });
  STRATA_RETURN_IF_ERROR(listed);
  return planes;
}

absl::StatusOr<std::vector<ProposedPose>> PostgresReader::ListProposedPoses(std::uint64_t job) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT scan, pose FROM truth_proposed_pose WHERE map = $1 AND job = $2 ORDER BY scan",
          job));
  std::vector<ProposedPose> poses;
  while (row.Next()) {
    absl::StatusOr<Pose> pose = DecodePose(row.Bytes(1));
    if (!pose.ok()) return Annotate(pose.status(), absl::StrCat("proposal of job ", job));
    poses.push_back({row.Unsigned(0), *pose});
  }
  return poses;
}

absl::StatusOr<std::vector<EpochInfo>> PostgresReader::ListEpochs() {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT e.epoch, e.created_us, e.reason, e.job, coalesce(p.decided, 0), m.epoch, "
          "m.oldest_epoch FROM truth_epoch AS e JOIN truth_map AS m ON m.map = e.map LEFT JOIN "
          "(SELECT epoch, count(*) AS decided FROM truth_pose WHERE map = $1 GROUP BY epoch) AS p "
          "ON p.epoch = e.epoch WHERE e.map = $1 ORDER BY e.epoch DESC"));
  std::vector<EpochInfo> epochs;
  while (row.Next()) epochs.push_back(ReadEpoch(row));
  return epochs;
}

absl::StatusOr<std::optional<EpochInfo>> PostgresReader::FindEpoch(std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(
      Rows row,
      Ask("SELECT e.epoch, e.created_us, e.reason, e.job, 0, m.epoch, m.oldest_epoch FROM "
          "truth_epoch AS e JOIN truth_map AS m ON m.map = e.map WHERE e.map = $1 AND e.epoch = $2",
          epoch));
  std::optional<EpochInfo> found;
  if (row.Next()) found = ReadEpoch(row);
  return found;
}

absl::Status PostgresWriter::PutPose(const PoseRecord& pose) {
  const std::string bytes = EncodePose(pose.T_map_scan);
  return RunSql(
      "INSERT INTO truth_pose (map, scan, epoch, pose, origin, aligned, message, overlap, rms_m, "
      "iterations) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10) ON CONFLICT (map, scan, epoch) "
      "DO UPDATE SET pose = $4, origin = $5, aligned = $6, message = $7, overlap = $8, rms_m = $9, "
      "iterations = $10",
      pose.scan,
      pose.epoch,
      Bytea{bytes},
      static_cast<int>(pose.origin),
      pose.report.aligned,
      pose.report.message,
      pose.report.overlap,
      pose.report.rms_m,
      pose.report.iterations);
}

absl::StatusOr<std::uint64_t> PostgresWriter::InsertConstraint(const ConstraintRecord& record,
                                                               std::uint64_t job) {
  const Constraint& constraint = record.constraint;
  const std::string pose = EncodePose(constraint.T_i_j);
  const std::string information = EncodeMatrix6(constraint.information);
  return Number(
      "WITH m AS (UPDATE truth_map SET last_constraint = last_constraint + 1 WHERE map = $1 "
      "RETURNING last_constraint, epoch) INSERT INTO truth_constraint (map, id, scan_i, scan_j, "
      "pose, information, origin, enabled, note, since_epoch, proposed_by, may_be_false) SELECT "
      "$1, m.last_constraint, $2, $3, $4, $5, $6, $7, $8, m.epoch, $9, $10 FROM m RETURNING id",
      record.scan_i,
      record.scan_j,
      Bytea{pose},
      Bytea{information},
      static_cast<int>(constraint.origin),
      constraint.enabled,
      constraint.note,
      job,
      constraint.may_be_false);
}

absl::StatusOr<std::uint64_t> PostgresWriter::PutConstraint(const ConstraintRecord& record) {
  return InsertConstraint(record, 0);
}

absl::Status PostgresWriter::DeleteConstraint(std::uint64_t id) {
  STRATA_ASSIGN_OR_RETURN(
      const std::uint64_t deleted,
      Change("DELETE FROM truth_constraint WHERE map = $1 AND id = $2 AND " STRATA_IN_FORCE, id));
  return deleted > 0 ? absl::OkStatus() : NoSuchConstraint(id);
}

absl::Status PostgresWriter::EnableConstraint(std::uint64_t id, bool enabled) {
  STRATA_ASSIGN_OR_RETURN(const std::uint64_t constraints,
                          Change("UPDATE truth_constraint SET enabled = $3 WHERE map = $1 AND id = "
                                 "$2 AND " STRATA_IN_FORCE,
                                 id,
                                 enabled));
  if (constraints > 0) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(
      const std::uint64_t planes,
      Change("UPDATE truth_plane SET enabled = $3 WHERE map = $1 AND id = $2 AND " STRATA_IN_FORCE,
             id,
             enabled));
  return planes > 0 ? absl::OkStatus() : NoSuchConstraint(id);
}

absl::Status PostgresWriter::ProposePose(std::uint64_t job, const ProposedPose& pose) {
  const std::string bytes = EncodePose(pose.T_map_scan);
  return RunSql(
      "INSERT INTO truth_proposed_pose (map, job, scan, pose) VALUES ($1, $2, $3, $4) ON CONFLICT "
      "(map, job, scan) DO UPDATE SET pose = excluded.pose",
      job,
      pose.scan,
      Bytea{bytes});
}

absl::Status PostgresWriter::ProposeConstraint(std::uint64_t job,
                                               const ConstraintRecord& constraint) {
  return InsertConstraint(constraint, job).status();
}

absl::Status PostgresWriter::ProposePlane(std::uint64_t job, const PlaneRecord& plane) {
  return InsertPlane(plane, job);
}

absl::Status PostgresWriter::InsertPlane(const PlaneRecord& record, std::uint64_t job) {
  const GlobalPlane& plane = record.plane;
  STRATA_ASSIGN_OR_RETURN(
      const std::uint64_t id,
      Number("WITH m AS (UPDATE truth_map SET last_constraint = last_constraint + 1 WHERE map = $1 "
             "RETURNING last_constraint, epoch) INSERT INTO truth_plane (map, id, normal_x, "
             "normal_y, normal_z, distance, kind, from_edges, enabled, note, since_epoch, "
             "until_epoch, proposed_by) SELECT $1, m.last_constraint, $2, $3, $4, $5, $6, $7, $8, "
             "$9, m.epoch, 4611686018427387904, $10 FROM m RETURNING id",
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
        RunSql("INSERT INTO truth_plane_support (map, plane, scan, weight, rms_m) VALUES ($1, $2, "
               "$3, $4, $5)",
               id,
               record.scans[k],
               plane.supports[k].weight,
               plane.supports[k].rms_m));
  }
  return absl::OkStatus();
}

absl::Status PostgresWriter::AdoptProposal(std::uint64_t job) {
  STRATA_RETURN_IF_ERROR(
      RunSql("UPDATE truth_plane AS p SET until_epoch = m.epoch FROM truth_map AS m WHERE m.map = "
             "$1 AND p.map = $1 AND p.proposed_by = 0 AND p.until_epoch > m.epoch"));
  return RunAll(
      {"UPDATE truth_plane AS p SET proposed_by = 0, since_epoch = m.epoch FROM truth_map AS m "
       "WHERE m.map = $1 AND p.map = $1 AND p.proposed_by = $2",
       "UPDATE truth_constraint AS c SET proposed_by = 0, since_epoch = m.epoch FROM truth_map AS "
       "m WHERE m.map = $1 AND c.map = $1 AND c.proposed_by = $2",
       "DELETE FROM truth_proposed_pose WHERE map = $1 AND job = $2"},
      job);
}

absl::Status PostgresWriter::DiscardProposal(std::uint64_t job) {
  return RunAll({"DELETE FROM truth_proposed_pose WHERE map = $1 AND job = $2",
                 "DELETE FROM truth_constraint WHERE map = $1 AND proposed_by = $2",
                 "DELETE FROM truth_plane_support WHERE map = $1 AND plane IN (SELECT id FROM "
                 "truth_plane WHERE map = $1 AND proposed_by = $2)",
                 "DELETE FROM truth_plane WHERE map = $1 AND proposed_by = $2"},
                job);
}

absl::StatusOr<std::uint64_t> PostgresWriter::BeginEpoch(absl::string_view reason,
                                                         std::uint64_t job) {
  return Number(
      "WITH m AS (UPDATE truth_map SET epoch = epoch + 1 WHERE map = $1 RETURNING epoch) INSERT "
      "INTO truth_epoch (map, epoch, created_us, reason, job) SELECT $1, m.epoch, $2, $3, $4 FROM "
      "m RETURNING epoch",
      absl::ToUnixMicros(absl::Now()),
      reason,
      job);
}

absl::Status PostgresWriter::RestoreConstraints(std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(const MapClock clock, reader_.GetClock());
  STRATA_ASSIGN_OR_RETURN(const EpochDifference difference,
                          DifferenceOfEpochs(reader_, epoch, clock.epoch));
  for (const std::uint64_t id : difference.ended_constraints) {
    STRATA_RETURN_IF_ERROR(
        RunSql("UPDATE truth_constraint SET until_epoch = $3 WHERE map = $1 AND id = $2",
               id,
               clock.epoch));
  }
  for (const ConstraintRecord& record : difference.restored_constraints) {
    STRATA_RETURN_IF_ERROR(InsertConstraint(record, 0).status());
  }
  for (const std::uint64_t id : difference.ended_planes) {
    STRATA_RETURN_IF_ERROR(RunSql(
        "UPDATE truth_plane SET until_epoch = $3 WHERE map = $1 AND id = $2", id, clock.epoch));
  }
  for (const PlaneRecord& record : difference.restored_planes) {
    STRATA_RETURN_IF_ERROR(InsertPlane(record, 0));
  }
  return absl::OkStatus();
}

absl::Status PostgresWriter::ForgetEpochsBefore(std::uint64_t epoch) {
  return RunAll(
      {"DELETE FROM truth_pose AS p WHERE p.map = $1 AND p.epoch < (SELECT max(young.epoch) FROM "
       "truth_pose AS young WHERE young.map = $1 AND young.scan = p.scan AND young.epoch <= $2)",
       "DELETE FROM truth_constraint WHERE map = $1 AND until_epoch <= $2 AND proposed_by = 0",
       "DELETE FROM truth_plane_support WHERE map = $1 AND plane IN (SELECT id FROM truth_plane "
       "WHERE map = $1 AND until_epoch <= $2 AND proposed_by = 0)",
       "DELETE FROM truth_plane WHERE map = $1 AND until_epoch <= $2 AND proposed_by = 0",
       "UPDATE truth_map SET oldest_epoch = greatest(oldest_epoch, $2) WHERE map = $1"},
      epoch);
}

}  // namespace strata
