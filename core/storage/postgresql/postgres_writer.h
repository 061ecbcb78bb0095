// StorageWriter on a connection that it holds for the time of a commit.
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_WRITER_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_WRITER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "absl/types/span.h"

#include "core/storage/postgresql/connection.h"
#include "core/storage/postgresql/connection_pool.h"
#include "core/storage/postgresql/postgres_reader.h"
#include "core/storage/storage.h"

namespace strata {

// A map as it was opened.
struct OpenedMap {
  std::int64_t number = 0;
  std::string name;
  std::int64_t owner = 0;        // the token of its lease; 0: anybody's
  std::int64_t last_commit = 0;  // when `owner` took it
  bool fenced = true;            // false: commits do not ask whose it is
  bool idle = false;             // commits are refused while somebody has it alone
  // Scans are added beside whoever has it alone, while less than so many wait; 0: not so.
  std::uint64_t beside = 0;
  // Commits are of this job, as long as its parameter kRunBy is `run_by`; empty: of none.
  std::uint64_t job = 0;
  std::string run_by = {};
  LastOwner last_owner = LastOwner::kSelf;
  // How long its owner may do nothing within a commit; then the database ends it.
  absl::Duration patience = absl::Seconds(20);
};

// What begins a commit into it.
std::string BeginOf(const OpenedMap& map);

// The map's own row, which begins with its owner: TakenAway() where there is no row or `map` has
// lost it.
absl::Status CheckOwner(absl::StatusOr<Rows>& owner, const OpenedMap& map);

class PostgresWriter final : public StorageWriter {
 public:
  PostgresWriter(std::shared_ptr<ConnectionPool> pool, const OpenedMap& map)
      : pool_(pool),
        opened_(map),
        map_(map.number),
        begin_(BeginOf(map)),
        last_commit_(map.last_commit),
        reader_(std::move(pool), map.number) {}

  absl::Status Commit(Durability durability, absl::FunctionRef<absl::Status()> body) override;
  absl::Status Part(absl::FunctionRef<absl::Status()> body) override;
  StorageReader& reader() override { return reader_; }
  absl::StatusOr<std::uint64_t> NextCommitSequence() override;
  absl::Status PutChanges(const std::vector<StoredChange>& changes) override;
  absl::StatusOr<std::uint64_t> PutEdit(const EditRequest& edit) override;
  absl::Status BeginEdit(std::uint64_t edit) override;
  absl::Status AnswerEdit(std::uint64_t edit, const absl::Status& answer) override;
  absl::StatusOr<bool> WithdrawEdit(std::uint64_t edit) override;
  absl::Status ForgetEdit(std::uint64_t edit) override;

  absl::Status PutChunk(std::uint64_t upload,
                        std::uint32_t ordinal,
                        absl::string_view bytes) override;
  absl::Status KeepUpload(const UnfinishedUpload& upload) override;
  absl::Status AbandonUpload(std::uint64_t upload) override;
  absl::Status AbandonOrphans() override;
  absl::Status PutScan(const ScanRecord& scan) override;
  absl::Status SetScanState(ScanNumber number, ScanState state, absl::string_view message) override;
  absl::Status DropPoints(ScanNumber number, absl::string_view local_map) override;
  absl::Status DeleteScan(ScanNumber number) override;
  absl::Status PutPose(const PoseRecord& pose) override;
  absl::StatusOr<std::uint64_t> PutConstraint(const ConstraintRecord& constraint) override;
  absl::Status DeleteConstraint(std::uint64_t id) override;
  absl::Status EnableConstraint(std::uint64_t id, bool enabled) override;
  absl::Status ProposePose(std::uint64_t job, const ProposedPose& pose) override;
  absl::Status ProposeConstraint(std::uint64_t job, const ConstraintRecord& constraint) override;
  absl::Status ProposePlane(std::uint64_t job, const PlaneRecord& plane) override;
  absl::Status AdoptProposal(std::uint64_t job) override;
  absl::Status DiscardProposal(std::uint64_t job) override;
  absl::StatusOr<std::uint64_t> BeginEpoch(absl::string_view reason, std::uint64_t job) override;
  absl::Status RestoreConstraints(std::uint64_t epoch) override;
  absl::Status ForgetEpochsBefore(std::uint64_t epoch) override;
  absl::Status PutProfile(absl::string_view name, const RobotProfile& profile) override;
  absl::Status PutOrigin(const GeodeticOrigin& origin) override;
  absl::Status PutClass(const MapClass& map_class) override;
  absl::Status PutLabels(ScanNumber number,
                         LabelOrigin origin,
                         std::uint64_t model,
                         const std::vector<std::string>& pieces) override;
  absl::StatusOr<std::uint64_t> PutClassifier(const ClassifierInfo& info,
                                              absl::string_view bytes) override;
  absl::Status DeleteClassifier(std::uint64_t id) override;
  absl::Status PutKind(const KindRow& row, absl::string_view shape) override;
  absl::Status RenameKind(std::uint64_t id, absl::string_view name) override;
  absl::Status DeleteKind(std::uint64_t id) override;
  absl::Status PutJob(const JobInfo& job) override;
  absl::Status DeleteJob(std::uint64_t id) override;
  absl::Status PutAttempt(const Attempt& attempt) override;
  absl::Status DeleteAttempt(const WorkId& work) override;

  absl::Status PutMlsTile(const MlsTileRow& row) override;
  absl::Status PutSurfaceTile(const SurfaceTileRow& row) override;
  absl::Status DeleteMlsTile(const TileKey& key) override;
  absl::Status DeleteOlderMlsTiles(const TileKey& key, std::uint64_t version) override;
  absl::Status CollectSurfaceTile(const TileKey& key, std::uint64_t floor) override;
  absl::Status CollectAllSurfaceTiles(std::uint64_t floor) override;
  absl::Status PutPreparedTile(const PreparedTileRow& row) override;
  absl::Status DeletePreparedTile(const TileKey& key) override;
  absl::Status PutPlaneModelPart(std::uint64_t job,
                                 std::uint64_t part,
                                 absl::string_view bytes) override;
  absl::Status DeletePlaneModel() override;
  absl::Status PutEntityPart(std::uint64_t job,
                             const EntityPart& part,
                             const std::vector<ScanNumber>& scans) override;
  absl::Status DeleteEntities() override;
  absl::Status PutInferredPart(std::uint64_t job,
                               std::uint64_t kind,
                               const EntityPart& part) override;
  absl::Status PutInferredScan(std::uint64_t kind, ScanNumber scan) override;
  absl::Status DeleteInferred() override;
  absl::Status PutFoundKind(const KindRow& row, absl::string_view shape) override;
  absl::Status DiscardUnpublished() override;
  absl::Status SetTilesOfScan(ScanNumber number, const std::vector<TileKey>& tiles) override;
  absl::Status SetFootprint(ScanNumber number, const Eigen::AlignedBox2d& footprint) override;
  absl::Status PutScanView(ScanNumber number, const ScanView& view) override;
  absl::Status DeleteOrphanIndexes() override;
  absl::Status PublishTiles(std::uint64_t version, bool complete) override;
  absl::Status DropDerived() override;

 private:
  // Of one run of a commit's body; `again`: what ended it may not come again.
  absl::Status CommitOnce(Durability durability,
                          absl::FunctionRef<absl::Status()> body,
                          bool& again);
  bool alone() const { return opened_.owner != 0; }
  // Takes the map's row, so that decisions follow each other; in a relaxed commit beside others,
  // which decides nothing, it only keeps the map from being deleted. `commit`: a number that no
  // other commit has, which is left there; 0: none is.
  absl::Status LockMap(Durability durability, std::int64_t commit);
  // The same for whoever has the map alone: its commit before is there, or else a confirmed one was
  // lost.
  absl::Status LockOwnMap(std::int64_t commit);
  // Of a map that somebody else has alone: it is there; in a full commit nobody else writes it
  // until the end. Leaves no number, which its owner would not know.
  absl::Status LockOthersMap(bool relaxed);
  // That the job of these commits has not been given to another.
  absl::Status CheckRunsJob();
  // What lets a scan in beside the map's owner.
  absl::Status CheckAdded(const ScanRecord& scan);
  // Keeps that all after `commit_sequence` is told, and nothing before it.
  absl::Status ForgetChanges(std::uint64_t commit_sequence);
  // Those of more than an hour ago.
  absl::Status TrimChanges();
  absl::Status RunBody(absl::FunctionRef<absl::Status()> body);
  absl::Status EndCommit(std::int64_t commit, bool& again);
  // Whether the commit with that number took place, as soon as the store answers. An error:
  // nobody knows.
  absl::StatusOr<bool> WasCommitted(std::int64_t commit);
  absl::StatusOr<bool> LookForCommit(std::int64_t commit);
  // The number of rows that a statement, whose $1 is the map, changed.
  template <typename... Values>
  absl::StatusOr<std::uint64_t> Change(const char* sql, const Values&... values);
  template <typename... Values>
  absl::Status RunSql(const char* sql, const Values&... values) {
    return Change(sql, values...).status();
  }
  // The number that a statement returns of the map's own row.
  template <typename... Values>
  absl::StatusOr<std::uint64_t> Number(const char* sql, const Values&... values);
  // Runs those whose $2 is `number`, too.
  absl::Status RunAll(absl::Span<const char* const> statements, std::uint64_t number);
  absl::StatusOr<std::uint64_t> InsertConstraint(const ConstraintRecord& record, std::uint64_t job);
  absl::Status InsertPlane(const PlaneRecord& record, std::uint64_t job);
  absl::Status PutClassifierParts(std::uint64_t id,
                                  const ClassifierInfo& info,
                                  absl::string_view bytes);

  std::shared_ptr<ConnectionPool> pool_;
  OpenedMap opened_;
  std::int64_t map_;
  std::string begin_;
  // The number of the last commit, if this writer has the map alone; nullopt: it is not known.
  std::optional<std::int64_t> last_commit_;
  PostgresReader reader_;
  Connection* connection_ = nullptr;  // in a commit
  Durability durability_ = Durability::kFull;
  unsigned puts_of_changes_ = 0;
  absl::Status broken_;  // the first error of a statement that no part has undone
};

template <typename... Values>
absl::StatusOr<std::uint64_t> PostgresWriter::Change(const char* sql, const Values&... values) {
  if (connection_ == nullptr) return absl::InternalError("store: a change outside a commit");
  absl::StatusOr<std::uint64_t> changed = connection_->Change(sql, map_, values...);
  if (!changed.ok() && broken_.ok()) broken_ = changed.status();
  return changed;
}

template <typename... Values>
absl::StatusOr<std::uint64_t> PostgresWriter::Number(const char* sql, const Values&... values) {
  if (connection_ == nullptr) return absl::InternalError("store: a change outside a commit");
  absl::StatusOr<Rows> rows = connection_->Query(sql, map_, values...);
  if (!rows.ok() && broken_.ok()) broken_ = rows.status();
  if (!rows.ok()) return rows.status();
  if (!rows->Next()) return absl::DataLossError("store: the map's own row is missing");
  return rows->Unsigned(0);
}

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_WRITER_H_
