// StorageWriter on the one SQLite connection that writes.
#ifndef STRATA_CORE_STORAGE_SQLITE_SQLITE_WRITER_H_
#define STRATA_CORE_STORAGE_SQLITE_SQLITE_WRITER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/storage/sqlite/database.h"
#include "core/storage/sqlite/file_state.h"
#include "core/storage/sqlite/sqlite_reader.h"
#include "core/storage/storage.h"

namespace strata {

class SqliteWriter final : public StorageWriter {
 public:
  explicit SqliteWriter(std::shared_ptr<Database> database)
      : connection_(std::move(database)), reader_(connection_) {}

  absl::Status Commit(Durability durability, absl::FunctionRef<absl::Status()> body) override;
  absl::Status Part(absl::FunctionRef<absl::Status()> body) override;
  StorageReader& reader() override { return reader_; }
  absl::StatusOr<std::uint64_t> NextCommitSequence() override;

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
  // Prepares, binds and runs a statement that returns nothing.
  template <typename... Values>
  absl::Status RunSql(const char* sql, const Values&... values);
  // Whether the last statement changed a row.
  absl::StatusOr<bool> Changed();
  // UNAVAILABLE if somebody has taken away a file that is open: what is written to it would be gone
  // with the process.
  absl::Status CheckFiles() const;
  // The next id of a constraint or plane.
  absl::StatusOr<std::uint64_t> NextConstraint();
  // From the current epoch on; `job`: only proposed by it, unless 0.
  absl::StatusOr<std::uint64_t> InsertConstraint(const ConstraintRecord& record, std::uint64_t job);
  absl::Status InsertPlane(const PlaneRecord& record, std::uint64_t job);

  std::shared_ptr<Database> connection_;
  Database& database_ = *connection_;
  SqliteReader reader_;
  Durability durability_ = Durability::kFull;  // what the connection is set to
  absl::Status broken_;                        // what ended the open transaction before its commit
  // As the last commit left them.
  std::optional<FileState> file_;
  std::optional<FileState> log_;
};

template <typename... Values>
absl::Status SqliteWriter::RunSql(const char* sql, const Values&... values) {
  absl::StatusOr<Statement> statement = database_.Prepare(sql);
  if (!statement.ok()) return statement.status();
  return statement->Bind(values...).Run();
}

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_SQLITE_SQLITE_WRITER_H_
