#include "tests/support/faults/answer_loss.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

#include "core/common/status.h"
#include "core/storage/outcome.h"

namespace strata::testing {
namespace {

class LosingWriter final : public StorageWriter {
 public:
  LosingWriter(StorageWriter& inner, AnswerLoss& loss) : inner_(inner), loss_(loss) {}

  absl::Status Commit(Durability durability, absl::FunctionRef<absl::Status()> body) override {
    const std::optional<bool> lost = loss_.NextCommit();
    if (!lost.has_value()) return inner_.Commit(durability, body);
    bool done = false;
    const absl::Status committed = inner_.Commit(durability, [&]() -> absl::Status {
      STRATA_RETURN_IF_ERROR(body());
      done = true;
      return *lost ? absl::OkStatus() : absl::InternalError("does not take place");
    });
    return done ? OutcomeUnknown("store: the answer was lost") : committed;
  }
  StorageReader& reader() override { return inner_.reader(); }
  absl::Status Part(absl::FunctionRef<absl::Status()> body) override { return inner_.Part(body); }
  absl::StatusOr<std::uint64_t> NextCommitSequence() override {
    return inner_.NextCommitSequence();
  }
  absl::Status PutChunk(std::uint64_t upload,
                        std::uint32_t ordinal,
                        absl::string_view bytes) override {
    return inner_.PutChunk(upload, ordinal, bytes);
  }
  absl::Status KeepUpload(const UnfinishedUpload& upload) override {
    return inner_.KeepUpload(upload);
  }
  absl::Status AbandonUpload(std::uint64_t upload) override { return inner_.AbandonUpload(upload); }
  absl::Status AbandonOrphans() override { return inner_.AbandonOrphans(); }
  absl::Status PutScan(const ScanRecord& scan) override { return inner_.PutScan(scan); }
  absl::Status SetScanState(ScanNumber number,
                            ScanState state,
                            absl::string_view message) override {
    return inner_.SetScanState(number, state, message);
  }
  absl::Status DropPoints(ScanNumber number, absl::string_view local_map) override {
    return inner_.DropPoints(number, local_map);
  }
  absl::Status PutLabels(ScanNumber number,
                         LabelOrigin origin,
                         std::uint64_t model,
                         const std::vector<std::string>& pieces) override {
    return inner_.PutLabels(number, origin, model, pieces);
  }
  absl::Status DeleteScan(ScanNumber number) override { return inner_.DeleteScan(number); }
  absl::Status PutPose(const PoseRecord& pose) override { return inner_.PutPose(pose); }
  absl::StatusOr<std::uint64_t> PutConstraint(const ConstraintRecord& constraint) override {
    return inner_.PutConstraint(constraint);
  }
  absl::Status DeleteConstraint(std::uint64_t id) override { return inner_.DeleteConstraint(id); }
  absl::Status EnableConstraint(std::uint64_t id, bool enabled) override {
    return inner_.EnableConstraint(id, enabled);
  }
  absl::Status ProposePose(std::uint64_t job, const ProposedPose& pose) override {
    return inner_.ProposePose(job, pose);
  }
  absl::Status ProposeConstraint(std::uint64_t job, const ConstraintRecord& constraint) override {
    return inner_.ProposeConstraint(job, constraint);
  }
  absl::Status ProposePlane(std::uint64_t job, const PlaneRecord& plane) override {
    return inner_.ProposePlane(job, plane);
  }
  absl::Status AdoptProposal(std::uint64_t job) override { return inner_.AdoptProposal(job); }
  absl::Status DiscardProposal(std::uint64_t job) override { return inner_.DiscardProposal(job); }
  absl::StatusOr<std::uint64_t> BeginEpoch(absl::string_view reason, std::uint64_t job) override {
    return inner_.BeginEpoch(reason, job);
  }
  absl::Status RestoreConstraints(std::uint64_t epoch) override {
    return inner_.RestoreConstraints(epoch);
  }
  absl::Status ForgetEpochsBefore(std::uint64_t epoch) override {
    return inner_.ForgetEpochsBefore(epoch);
  }
  absl::Status PutProfile(absl::string_view name, const RobotProfile& profile) override {
    return inner_.PutProfile(name, profile);
  }
  absl::Status PutOrigin(const GeodeticOrigin& origin) override { return inner_.PutOrigin(origin); }
  absl::Status PutClass(const MapClass& map_class) override { return inner_.PutClass(map_class); }
  absl::StatusOr<std::uint64_t> PutClassifier(const ClassifierInfo& info,
                                              absl::string_view bytes) override {
    return inner_.PutClassifier(info, bytes);
  }
  absl::Status DeleteClassifier(std::uint64_t id) override { return inner_.DeleteClassifier(id); }
  absl::Status PutKind(const KindRow& row, absl::string_view shape) override {
    return inner_.PutKind(row, shape);
  }
  absl::Status RenameKind(std::uint64_t id, absl::string_view name) override {
    return inner_.RenameKind(id, name);
  }
  absl::Status DeleteKind(std::uint64_t id) override { return inner_.DeleteKind(id); }
  absl::Status PutJob(const JobInfo& job) override { return inner_.PutJob(job); }
  absl::Status DeleteJob(std::uint64_t id) override { return inner_.DeleteJob(id); }
  absl::Status PutAttempt(const Attempt& attempt) override { return inner_.PutAttempt(attempt); }
  absl::Status DeleteAttempt(const WorkId& work) override { return inner_.DeleteAttempt(work); }
  absl::Status PutMlsTile(const MlsTileRow& row) override { return inner_.PutMlsTile(row); }
  absl::Status PutSurfaceTile(const SurfaceTileRow& row) override {
    return inner_.PutSurfaceTile(row);
  }
  absl::Status DeleteMlsTile(const TileKey& key) override { return inner_.DeleteMlsTile(key); }
  absl::Status DeleteOlderMlsTiles(const TileKey& key, std::uint64_t version) override {
    return inner_.DeleteOlderMlsTiles(key, version);
  }
  absl::Status CollectSurfaceTile(const TileKey& key, std::uint64_t floor) override {
    return inner_.CollectSurfaceTile(key, floor);
  }
  absl::Status CollectAllSurfaceTiles(std::uint64_t floor) override {
    return inner_.CollectAllSurfaceTiles(floor);
  }
  absl::Status PutPreparedTile(const PreparedTileRow& row) override {
    return inner_.PutPreparedTile(row);
  }
  absl::Status DeletePreparedTile(const TileKey& key) override {
    return inner_.DeletePreparedTile(key);
  }
  absl::Status PutPlaneModelPart(std::uint64_t job,
                                 std::uint64_t part,
                                 absl::string_view bytes) override {
    return inner_.PutPlaneModelPart(job, part, bytes);
  }
  absl::Status DeletePlaneModel() override { return inner_.DeletePlaneModel(); }
  absl::Status PutEntityPart(std::uint64_t job,
                             const EntityPart& part,
                             const std::vector<ScanNumber>& scans) override {
    return inner_.PutEntityPart(job, part, scans);
  }
  absl::Status PutInferredPart(std::uint64_t job,
                               std::uint64_t kind,
                               const EntityPart& part) override {
    return inner_.PutInferredPart(job, kind, part);
  }
  absl::Status PutInferredScan(std::uint64_t kind, ScanNumber scan) override {
    return inner_.PutInferredScan(kind, scan);
  }
  absl::Status DeleteInferred() override { return inner_.DeleteInferred(); }
  absl::Status DeleteEntities() override { return inner_.DeleteEntities(); }
  absl::Status PutFoundKind(const KindRow& row, absl::string_view shape) override {
    return inner_.PutFoundKind(row, shape);
  }
  absl::Status DiscardUnpublished() override { return inner_.DiscardUnpublished(); }
  absl::Status SetTilesOfScan(ScanNumber number, const std::vector<TileKey>& tiles) override {
    return inner_.SetTilesOfScan(number, tiles);
  }
  absl::Status SetFootprint(ScanNumber number, const Eigen::AlignedBox2d& footprint) override {
    return inner_.SetFootprint(number, footprint);
  }
  absl::Status PutScanView(ScanNumber number, const ScanView& view) override {
    return inner_.PutScanView(number, view);
  }
  absl::Status DeleteOrphanIndexes() override { return inner_.DeleteOrphanIndexes(); }
  absl::Status PublishTiles(std::uint64_t version, bool complete) override {
    return inner_.PublishTiles(version, complete);
  }
  absl::Status DropDerived() override { return inner_.DropDerived(); }

 private:
  StorageWriter& inner_;
  AnswerLoss& loss_;
};

class LosingStorage final : public MapStorage {
 public:
  LosingStorage(std::unique_ptr<MapStorage> inner, AnswerLoss& loss)
      : inner_(std::move(inner)), writer_(inner_->writer(), loss) {}

  absl::StatusOr<std::unique_ptr<StorageReader>> NewReader() override {
    return inner_->NewReader();
  }
  StorageWriter& writer() override { return writer_; }
  absl::Status CheckInPlace() const override { return inner_->CheckInPlace(); }
  absl::Status CheckHeld() const override { return inner_->CheckHeld(); }
  LastOwner last_owner() const override { return inner_->last_owner(); }

 private:
  std::unique_ptr<MapStorage> inner_;
  LosingWriter writer_;
};

class LosingStores final : public MapStores {
 public:
  LosingStores(std::unique_ptr<MapStores> inner, AnswerLoss& loss)
      : inner_(std::move(inner)), loss_(loss) {}

  absl::StatusOr<std::vector<std::string>> List() const override { return inner_->List(); }
  absl::Status Survey(const Stop& stop, TellOutline tell) const override {
    return inner_->Survey(stop, tell);
  }
  absl::Status Create(absl::string_view name,
                      const MapParameters& parameters,
                      absl::Time created) const override {
    return inner_->Create(name, parameters, created);
  }
  absl::StatusOr<StoredMap> Open(absl::string_view name) const override {
    STRATA_ASSIGN_OR_RETURN(StoredMap stored, inner_->Open(name));
    stored.storage = LoseAnswers(std::move(stored.storage), loss_);
    return stored;
  }
  absl::Status CheckRemovable(absl::string_view name) const override {
    return inner_->CheckRemovable(name);
  }
  absl::Status Delete(absl::string_view name, std::uint64_t clock) const override {
    return inner_->Delete(name, clock);
  }
  std::filesystem::path FileOf(absl::string_view name) const override {
    return inner_->FileOf(name);
  }

 private:
  std::unique_ptr<MapStores> inner_;
  AnswerLoss& loss_;
};

}  // namespace

void AnswerLoss::LoseAfter(int commits, bool takes_place) {
  absl::MutexLock lock(&mutex_);
  lost_at_ = commits_ + commits;
  takes_place_ = takes_place;
}

std::optional<bool> AnswerLoss::NextCommit() {
  absl::MutexLock lock(&mutex_);
  return commits_++ == lost_at_ ? std::optional<bool>(takes_place_) : std::nullopt;
}

int AnswerLoss::commits() const {
  absl::MutexLock lock(&mutex_);
  return commits_;
}

bool AnswerLoss::lost() const {
  absl::MutexLock lock(&mutex_);
  return lost_at_ >= 0 && commits_ > lost_at_;
}

std::unique_ptr<MapStorage> LoseAnswers(std::unique_ptr<MapStorage> inner, AnswerLoss& loss) {
  return std::make_unique<LosingStorage>(std::move(inner), loss);
}

std::unique_ptr<MapStores> LoseAnswers(std::unique_ptr<MapStores> inner, AnswerLoss& loss) {
  return std::make_unique<LosingStores>(std::move(inner), loss);
}

}  // namespace strata::testing
