// StorageReader on a SQLite connection.
#ifndef STRATA_CORE_STORAGE_SQLITE_SQLITE_READER_H_
#define STRATA_CORE_STORAGE_SQLITE_SQLITE_READER_H_

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

#include "core/storage/sqlite/database.h"
#include "core/storage/storage.h"

namespace strata {

class SqliteReader final : public StorageReader {
 public:
  explicit SqliteReader(std::shared_ptr<Database> database) : connection_(std::move(database)) {}

  absl::Status Snapshot(absl::FunctionRef<absl::Status()> body) override;
  absl::Status CopyTo(const std::filesystem::path& file, const Stop& stop) override;
  absl::StatusOr<MapClock> GetClock() override;
  absl::StatusOr<MapInfo> GetMapInfo() override;
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
  absl::Status ReadJobDetails(JobInfo& job);
  absl::Status ReadClassifierDetails(ClassifierInfo& info);
  absl::Status ReadSupports(PlaneRecord& record);
  // Of tables that hold the result of one job, in parts.
  absl::StatusOr<std::optional<EntityPart>> FindPartAfter(const char* sql,
                                                          std::uint64_t job,
                                                          std::optional<std::uint64_t> after);
  absl::StatusOr<std::uint64_t> LastJob(const char* sql);

  std::shared_ptr<Database> connection_;
  Database& database_ = *connection_;
};

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_SQLITE_SQLITE_READER_H_
