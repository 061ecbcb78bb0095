// StorageReader on connections of a pool.
#ifndef STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_READER_H_
#define STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_READER_H_

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/storage/postgresql/connection.h"
#include "core/storage/postgresql/connection_pool.h"
#include "core/storage/postgresql/map_leases.h"
#include "core/storage/storage.h"

namespace strata {

// Holds a connection for the time of a call or of a snapshot only.
class PostgresReader final : public StorageReader {
 public:
  // `lease`: of one who has the map alone, and reads what nobody else may collect beneath him.
  PostgresReader(std::shared_ptr<ConnectionPool> pool,
                 std::int64_t map,
                 std::shared_ptr<const MapLease> lease = nullptr)
      : pool_(std::move(pool)), map_(map), lease_(std::move(lease)) {}

  // Reads go through `connection`, in its transaction, until this is called with nullptr.
  void ReadThrough(Connection* connection) { held_ = connection; }

  absl::Status Snapshot(absl::FunctionRef<absl::Status()> body) override;
  absl::Status LongSnapshot(absl::FunctionRef<absl::Status()> body) override;
  absl::Status CopyTo(const std::filesystem::path& file, const Stop& stop) override;
  absl::StatusOr<MapClock> GetClock() override;
  absl::StatusOr<MapInfo> GetMapInfo() override;
  absl::StatusOr<StoredChanges> ListChanges(std::uint64_t since) override;
  absl::StatusOr<std::optional<EditRequest>> FindEdit(std::uint64_t after,
                                                      std::uint64_t until) override;
  absl::StatusOr<std::uint64_t> LastEdit() override;
  absl::StatusOr<std::optional<absl::Status>> FindAnswer(std::uint64_t edit) override;
  absl::StatusOr<std::optional<PosedScan>> FindScan(const ScanId& id, std::uint64_t epoch) override;
  absl::StatusOr<PosedScan> GetScan(ScanNumber number, std::uint64_t epoch) override;
  absl::StatusOr<std::vector<ScanNumber>> ListScanNumbers() override;
  absl::Status CheckScanRow(ScanNumber number) override;
  absl::StatusOr<std::vector<PosedScan>> ListScans(const ScanQuery& query,
                                                   std::uint64_t epoch) override;
  absl::StatusOr<UploadState> GetUploadState(absl::string_view trajectory) override;
  absl::StatusOr<ScanTotals> GetScanTotals() override;
  absl::StatusOr<std::vector<UnfinishedUpload>> ListUnfinishedUploads() override;
  absl::StatusOr<std::string> GetChunk(std::uint64_t upload, std::uint32_t ordinal) override;
  absl::StatusOr<std::string> GetLocalMap(ScanNumber number) override;
  absl::StatusOr<std::vector<ConstraintRecord>> ListConstraints(std::uint64_t epoch) override;
  absl::StatusOr<std::vector<PlaneRecord>> ListPlanes(std::uint64_t epoch) override;
  absl::StatusOr<std::vector<ProposedPose>> ListProposedPoses(std::uint64_t job) override;
  absl::StatusOr<std::vector<EpochInfo>> ListEpochs() override;
  absl::StatusOr<std::optional<EpochInfo>> FindEpoch(std::uint64_t epoch) override;
  absl::StatusOr<std::map<std::string, RobotProfile>> ListProfiles() override;
  absl::StatusOr<std::optional<std::string>> FindLabels(ScanNumber number,
                                                        LabelOrigin origin,
                                                        std::uint32_t piece) override;
  absl::StatusOr<std::vector<MapClass>> ListClasses() override;
  absl::StatusOr<std::vector<ClassifierInfo>> ListClassifiers() override;
  absl::StatusOr<std::string> GetClassifier(std::uint64_t id) override;
  absl::StatusOr<std::optional<JobInfo>> FindJob(std::uint64_t id) override;
  absl::StatusOr<std::vector<JobInfo>> ListJobs() override;
  absl::StatusOr<std::vector<Attempt>> ListAttempts() override;
  absl::StatusOr<std::optional<MlsTileRow>> FindMlsTile(const TileKey& key,
                                                        std::uint64_t version) override;
  absl::StatusOr<std::optional<SurfaceTileRow>> FindSurfaceTile(const TileKey& key,
                                                                std::uint64_t version) override;
  absl::StatusOr<std::vector<MlsTileRow>> ListMlsTiles(std::uint64_t version) override;
  absl::StatusOr<std::vector<SurfaceTileRow>> ListSurfaceTiles(const TileRange& range,
                                                               std::uint64_t version) override;
  absl::StatusOr<std::optional<std::string>> FindPreparedTile(const TileKey& key,
                                                              absl::string_view made_of) override;
  absl::StatusOr<std::vector<PreparedTileRow>> ListPreparedTiles() override;
  absl::StatusOr<std::optional<std::string>> FindPlaneModelPart(std::uint64_t job,
                                                                std::uint64_t part) override;
  absl::StatusOr<std::uint64_t> JobOfPlaneModel() override;
  absl::StatusOr<std::optional<EntityPart>> FindEntityPart(
      std::uint64_t job, std::optional<std::uint64_t> after) override;
  absl::StatusOr<std::uint64_t> JobOfEntities() override;
  absl::StatusOr<std::optional<EntityPart>> FindInferredPart(
      std::uint64_t job, std::optional<std::uint64_t> after) override;
  absl::StatusOr<std::uint64_t> JobOfInferred() override;
  absl::StatusOr<std::vector<KindRow>> ListKinds() override;
  absl::StatusOr<std::optional<std::string>> FindKindShape(std::uint64_t id) override;
  absl::StatusOr<std::vector<ScanNumber>> ScansOfTile(const TileKey& key) override;
  absl::StatusOr<std::vector<TileKey>> TilesOfScan(ScanNumber number) override;
  absl::StatusOr<std::optional<Eigen::AlignedBox2d>> FootprintOfScan(ScanNumber number) override;
  absl::StatusOr<ScanView> FindScanView(ScanNumber number) override;

 private:
  // A snapshot that `begin` begins.
  absl::Status SnapshotOf(const char* begin, absl::FunctionRef<absl::Status()> body);
  // What `body` reads is of one state, which a snapshot or transaction around it may be.
  absl::Status OneState(absl::FunctionRef<absl::Status()> body);
  // What was read of a version, once it has been read: as MapLease::Check().
  absl::Status CheckKept() const { return lease_ == nullptr ? absl::OkStatus() : lease_->Check(); }
  // The rows of a statement whose $1 is the map.
  template <typename... Values>
  absl::StatusOr<Rows> Ask(const char* sql, const Values&... values);
  absl::StatusOr<std::optional<PosedScan>> AskForScan(absl::StatusOr<Rows> rows);
  absl::StatusOr<std::vector<ScanNumber>> AskForNumbers(absl::StatusOr<Rows> rows);
  absl::StatusOr<std::optional<std::string>> AskForBytes(absl::StatusOr<Rows> rows);
  absl::StatusOr<std::optional<EntityPart>> AskForPart(absl::StatusOr<Rows> rows);
  absl::StatusOr<std::uint64_t> AskForNumber(absl::StatusOr<Rows> rows);
  absl::StatusOr<Rows> AskForScans(const ScanQuery& query,
                                   std::uint64_t after,
                                   std::uint64_t limit,
                                   std::uint64_t epoch);
  absl::Status ReadJobDetails(std::vector<JobInfo>& jobs);

  std::shared_ptr<ConnectionPool> pool_;
  std::int64_t map_;
  std::shared_ptr<const MapLease> lease_;
  Connection* held_ = nullptr;
};

template <typename... Values>
absl::StatusOr<Rows> PostgresReader::Ask(const char* sql, const Values&... values) {
  if (held_ != nullptr) return held_->Query(sql, map_, values...);
  absl::StatusOr<ConnectionPool::Lease> lease = pool_->Take();
  if (!lease.ok()) return lease.status();
  return (*lease)->Query(sql, map_, values...);
}

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_POSTGRESQL_POSTGRES_READER_H_
