// What is durable for one map, whoever keeps it: core/storage/sqlite in one file,
// core/storage/postgresql in a database with other maps. Blobs are opaque here; codecs check them.
// Texts are UTF-8 without zero bytes; a store may refuse others with INVALID_ARGUMENT.
#ifndef STRATA_CORE_STORAGE_STORAGE_H_
#define STRATA_CORE_STORAGE_STORAGE_H_

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/storage/records.h"
#include "core/world/classifier_info.h"
#include "core/world/epoch.h"
#include "core/world/job.h"
#include "core/world/map_class.h"
#include "core/world/map_info.h"
#include "core/world/robot_profile.h"
#include "core/world/scan.h"

namespace strata {

// Edits that wait at once in a map.
inline constexpr std::uint64_t kMostEdits = 1000;

inline absl::Status NoEdit(std::uint64_t number) {
  return absl::NotFoundError(absl::StrCat("edit ", number, " does not exist"));
}

// Reads. One thread at a time; every call sees one committed state of its own, several calls inside
// Snapshot() see the same one. A damaged row is DATA_LOSS naming it; a missing thing is NOT_FOUND
// where the result is not optional.
class StorageReader {
 public:
  virtual ~StorageReader() = default;

  // All reads of `body` see one state. Keep it short: the store cannot reclaim space meanwhile.
  virtual absl::Status Snapshot(absl::FunctionRef<absl::Status()> body) = 0;
  // The same for a body that may compute for minutes between two reads, and waits for nobody.
  virtual absl::Status LongSnapshot(absl::FunctionRef<absl::Status()> body) {
    return Snapshot(body);
  }

  // Writes one committed state as a store of its own into `file`, which must not be there; closed
  // and whole when this returns. Commits go on meanwhile. Not inside Snapshot(). ALREADY_EXISTS;
  // CANCELLED, DEADLINE_EXCEEDED by `stop`, which leave an unusable file.
  virtual absl::Status CopyTo(const std::filesystem::path& file, const Stop& stop) = 0;

  virtual absl::StatusOr<MapClock> GetClock() = 0;
  virtual absl::StatusOr<MapInfo> GetMapInfo() = 0;
  // What changed after commit `since`, in the order of commits: what PutChanges() said, and scans
  // that came since. Kept for an hour at least. A store that no other process reads keeps none.
  virtual absl::StatusOr<StoredChanges> ListChanges(std::uint64_t /*since*/) {
    return StoredChanges();
  }

  virtual absl::StatusOr<std::optional<PosedScan>> FindScan(const ScanId& id,
                                                            std::uint64_t epoch) = 0;
  virtual absl::StatusOr<PosedScan> GetScan(ScanNumber number, std::uint64_t epoch) = 0;
  // Numbers of all scans, ascending. Reads nothing else of their rows, so a damaged one hides none.
  virtual absl::StatusOr<std::vector<ScanNumber>> ListScanNumbers() = 0;
  // DATA_LOSS if points or time, which it is found by, are not its header's, and for damaged poses.
  virtual absl::Status CheckScanRow(ScanNumber number) = 0;
  // By number.
  virtual absl::StatusOr<std::vector<PosedScan>> ListScans(const ScanQuery& query,
                                                           std::uint64_t epoch) = 0;
  virtual absl::StatusOr<UploadState> GetUploadState(absl::string_view trajectory) = 0;
  virtual absl::StatusOr<ScanTotals> GetScanTotals() = 0;
  // By upload number.
  virtual absl::StatusOr<std::vector<UnfinishedUpload>> ListUnfinishedUploads() = 0;
  virtual absl::StatusOr<std::string> GetChunk(std::uint64_t upload, std::uint32_t ordinal) = 0;
  // The local map of a scan whose points were dropped.
  virtual absl::StatusOr<std::string> GetLocalMap(ScanNumber number) = 0;
  // Those of `epoch`, by id; proposed ones are left out.
  virtual absl::StatusOr<std::vector<ConstraintRecord>> ListConstraints(std::uint64_t epoch) = 0;
  virtual absl::StatusOr<std::vector<PlaneRecord>> ListPlanes(std::uint64_t epoch) = 0;
  // What a job has proposed, by scan; empty when nothing is.
  virtual absl::StatusOr<std::vector<ProposedPose>> ListProposedPoses(std::uint64_t job) = 0;
  // Newest first; the newest is the current one. Looks at all poses: `decided` counts them.
  virtual absl::StatusOr<std::vector<EpochInfo>> ListEpochs() = 0;
  // Of it, at no cost: `decided` stays 0. nullopt for one that never was.
  virtual absl::StatusOr<std::optional<EpochInfo>> FindEpoch(std::uint64_t epoch) = 0;
  virtual absl::StatusOr<std::map<std::string, RobotProfile>> ListProfiles() = 0;
  // Piece `piece` of a scan's labels; nullopt where there is none.
  virtual absl::StatusOr<std::optional<std::string>> FindLabels(ScanNumber number,
                                                                LabelOrigin origin,
                                                                std::uint32_t piece) = 0;
  // By id.
  virtual absl::StatusOr<std::vector<MapClass>> ListClasses() = 0;
  virtual absl::StatusOr<std::vector<ClassifierInfo>> ListClassifiers() = 0;
  virtual absl::StatusOr<std::string> GetClassifier(std::uint64_t id) = 0;
  virtual absl::StatusOr<std::optional<JobInfo>> FindJob(std::uint64_t id) = 0;
  virtual absl::StatusOr<std::vector<JobInfo>> ListJobs() = 0;
  // By kind and id.
  virtual absl::StatusOr<std::vector<Attempt>> ListAttempts() = 0;

  // Edits that were asked for elsewhere (StorageWriter::PutEdit()): the first that waits with a
  // number in (after, until], but for EditKind::kDeleteMap. A store that no other process writes
  // has none.
  virtual absl::StatusOr<std::optional<EditRequest>> FindEdit(std::uint64_t /*after*/,
                                                              std::uint64_t /*until*/) {
    return std::nullopt;
  }
  // The number of the last such that waits; 0: none.
  virtual absl::StatusOr<std::uint64_t> LastEdit() { return 0; }
  // What became of one; nullopt: it waits. NOT_FOUND once it was withdrawn or forgotten.
  virtual absl::StatusOr<std::optional<absl::Status>> FindAnswer(std::uint64_t edit) {
    return NoEdit(edit);
  }

  // The newest row of `key` that is not newer than `version`; nullopt where there is none or it
  // says that the tile is gone.
  virtual absl::StatusOr<std::optional<MlsTileRow>> FindMlsTile(const TileKey& key,
                                                                std::uint64_t version) = 0;
  virtual absl::StatusOr<std::optional<SurfaceTileRow>> FindSurfaceTile(const TileKey& key,
                                                                        std::uint64_t version) = 0;
  // By key, without bytes. Tiles that are gone are left out.
  virtual absl::StatusOr<std::vector<MlsTileRow>> ListMlsTiles(std::uint64_t version) = 0;
  virtual absl::StatusOr<std::vector<SurfaceTileRow>> ListSurfaceTiles(const TileRange& range,
                                                                       std::uint64_t version) = 0;
  // The bytes kept of `key` if they are made of `made_of`; nullopt otherwise.
  virtual absl::StatusOr<std::optional<std::string>> FindPreparedTile(
      const TileKey& key, absl::string_view made_of) = 0;
  // By key, without bytes.
  virtual absl::StatusOr<std::vector<PreparedTileRow>> ListPreparedTiles() = 0;
  // What is kept of the plane model that a job made: part 0 is what holds of all of it, the others
  // are its planes. nullopt: no such part; the model of another job, or none.
  virtual absl::StatusOr<std::optional<std::string>> FindPlaneModelPart(std::uint64_t job,
                                                                        std::uint64_t part) = 0;
  // The job whose model is kept; 0: none.
  virtual absl::StatusOr<std::uint64_t> JobOfPlaneModel() = 0;
  // The first part after `after` that is kept of the entities that a job found, and its number:
  // part 0 is what holds of all of them, the others are one each. nullopt: no more, or of another
  // job.
  virtual absl::StatusOr<std::optional<EntityPart>> FindEntityPart(
      std::uint64_t job, std::optional<std::uint64_t> after) = 0;
  // The job whose entities are kept; 0: none.
  virtual absl::StatusOr<std::uint64_t> JobOfEntities() = 0;
  // The same of what was inferred of them.
  virtual absl::StatusOr<std::optional<EntityPart>> FindInferredPart(
      std::uint64_t job, std::optional<std::uint64_t> after) = 0;
  virtual absl::StatusOr<std::uint64_t> JobOfInferred() = 0;
  // Without shapes: those of the library, then those that the job found and the library has not,
  // each by id.
  virtual absl::StatusOr<std::vector<KindRow>> ListKinds() = 0;
  // The library's, or else the one that a job found; nullopt: there is none.
  virtual absl::StatusOr<std::optional<std::string>> FindKindShape(std::uint64_t id) = 0;
  // Scan ↔ tile relation of integrated scans, level 0, each in ascending order.
  virtual absl::StatusOr<std::vector<ScanNumber>> ScansOfTile(const TileKey& key) = 0;
  virtual absl::StatusOr<std::vector<TileKey>> TilesOfScan(ScanNumber number) = 0;
  // nullopt: none stored (a scan without finite points, or damage).
  virtual absl::StatusOr<std::optional<Eigen::AlignedBox2d>> FootprintOfScan(ScanNumber number) = 0;
  // Empty where none is stored.
  virtual absl::StatusOr<ScanView> FindScanView(ScanNumber number) = 0;
};

// When a commit returns.
enum class Durability : std::uint8_t {
  kFull,  // once it survives loss of power
  // Once it survives the end of the process. A later kFull commit covers it too; none succeeds
  // where it was lost with the store's end.
  kRelaxed,
};

// Writes. One thread at a time. Everything but Commit() itself is called inside its body.
class StorageWriter {
 public:
  virtual ~StorageWriter() = default;

  // Runs `body` in one transaction: all of it or, on an error, nothing. A store that others write
  // to as well may run `body` again, a few times, each time on the state that it then finds: what
  // it leaves in the memory of its caller must be what its last run left alone. ABORTED: others
  // were in the way each time. OutcomeUnknown() where the store went away while it committed, and
  // for the first commit after one of this writer's was lost that was confirmed (a kRelaxed one
  // with the store's end; others where a store goes back): the caller looks, later, what is there.
  virtual absl::Status Commit(Durability durability, absl::FunctionRef<absl::Status()> body) = 0;
  // A part of a commit that fails alone: on an error only what `body` did is undone.
  virtual absl::Status Part(absl::FunctionRef<absl::Status()> body) = 0;
  // Sees what the open transaction wrote.
  virtual StorageReader& reader() = 0;

  // Ticks the clock of the map. In a kFull commit only: a number that somebody was told is never
  // given again.
  virtual absl::StatusOr<std::uint64_t> NextCommitSequence() = 0;
  // What this commit, whose last number they have, changes for those who watch the map; scans that
  // it adds are known without. Names of trajectories must be valid (ValidateName).
  virtual absl::Status PutChanges(const std::vector<StoredChange>& /*changes*/) {
    return absl::OkStatus();
  }

  // Asks who has the map alone for an edit; its number. It waits for an hour at most, and its
  // answer is kept as long. RESOURCE_EXHAUSTED while kMostEdits wait.
  virtual absl::StatusOr<std::uint64_t> PutEdit(const EditRequest& /*edit*/) {
    return absl::UnimplementedError("store: nobody else has the map");
  }
  // It is carried out from now on.
  virtual absl::Status BeginEdit(std::uint64_t edit) { return NoEdit(edit); }
  // It has been carried out, by the same commit, or why it was not: with all that is attached to
  // `answer`. ABORTED where it does not wait any more, so that a commit of it is undone.
  virtual absl::Status AnswerEdit(std::uint64_t edit, const absl::Status& /*answer*/) {
    return NoEdit(edit);
  }
  // Whether it waited, and will not be carried out.
  virtual absl::StatusOr<bool> WithdrawEdit(std::uint64_t edit) { return NoEdit(edit); }
  // Its answer was read.
  virtual absl::Status ForgetEdit(std::uint64_t edit) { return NoEdit(edit); }

  // Points of an upload that is not a scan yet; `bytes` at most 1 MiB.
  virtual absl::Status PutChunk(std::uint64_t upload,
                                std::uint32_t ordinal,
                                absl::string_view bytes) = 0;
  // An upload under way whose chunks AbandonOrphans() leaves; inserts, or says when points last
  // came. `upload.chunks` and `bytes` are ignored: they are counted.
  virtual absl::Status KeepUpload(const UnfinishedUpload& upload) = 0;
  // Removes the chunks of an upload that never became a scan.
  virtual absl::Status AbandonUpload(std::uint64_t upload) = 0;
  // Removes all chunks without a scan and without a KeepUpload().
  virtual absl::Status AbandonOrphans() = 0;
  // Makes an upload a scan, which is unfinished no longer. ALREADY_EXISTS for its id.
  virtual absl::Status PutScan(const ScanRecord& scan) = 0;
  virtual absl::Status SetScanState(ScanNumber number,
                                    ScanState state,
                                    absl::string_view message) = 0;
  // Keeps `local_map` (core/codec's map bytes) instead of the points and their labels.
  virtual absl::Status DropPoints(ScanNumber number, absl::string_view local_map) = 0;
  // Labels of a scan in place of earlier ones of that origin, in order, each piece at most 1 MiB;
  // none: takes them away. `model`: that gave them; 0 for a person; of kFaded, how many points.
  virtual absl::Status PutLabels(ScanNumber number,
                                 LabelOrigin origin,
                                 std::uint64_t model,
                                 const std::vector<std::string>& pieces) = 0;
  // With its chunks, labels, local map, poses, constraints, footprint and tile relation.
  virtual absl::Status DeleteScan(ScanNumber number) = 0;

  virtual absl::Status PutPose(const PoseRecord& pose) = 0;
  // From the current epoch on; returns its id.
  virtual absl::StatusOr<std::uint64_t> PutConstraint(const ConstraintRecord& constraint) = 0;
  // In every epoch. NOT_FOUND.
  virtual absl::Status DeleteConstraint(std::uint64_t id) = 0;
  // A constraint or a plane by its id. NOT_FOUND.
  virtual absl::Status EnableConstraint(std::uint64_t id, bool enabled) = 0;
  // What a job would change; nobody sees it until it is adopted. Poses replace earlier ones.
  virtual absl::Status ProposePose(std::uint64_t job, const ProposedPose& pose) = 0;
  virtual absl::Status ProposeConstraint(std::uint64_t job, const ConstraintRecord& constraint) = 0;
  virtual absl::Status ProposePlane(std::uint64_t job, const PlaneRecord& plane) = 0;
  // The job's constraints join those of the current epoch, its planes replace them, and its poses
  // are forgotten: the caller has put them.
  virtual absl::Status AdoptProposal(std::uint64_t job) = 0;
  virtual absl::Status DiscardProposal(std::uint64_t job) = 0;
  // Begins the next epoch, which starts with poses and constraints of the current one; returns its
  // number. `job`: that makes it, or 0.
  virtual absl::StatusOr<std::uint64_t> BeginEpoch(absl::string_view reason, std::uint64_t job) = 0;
  // What optimize jobs found (constraints of that origin, planes) is in the current epoch as it was
  // in `epoch`.
  virtual absl::Status RestoreConstraints(std::uint64_t epoch) = 0;
  // Poses that only epochs before `epoch` use; those can not be gone back to any more.
  virtual absl::Status ForgetEpochsBefore(std::uint64_t epoch) = 0;
  virtual absl::Status PutProfile(absl::string_view name, const RobotProfile& profile) = 0;
  // Inserts or replaces. ALREADY_EXISTS where another id has the name.
  virtual absl::Status PutOrigin(const GeodeticOrigin& origin) = 0;
  virtual absl::Status PutClass(const MapClass& map_class) = 0;
  // Under a new id, which it returns; that of `info` is ignored. ALREADY_EXISTS for its name.
  virtual absl::StatusOr<std::uint64_t> PutClassifier(const ClassifierInfo& info,
                                                      absl::string_view bytes) = 0;
  virtual absl::Status DeleteClassifier(std::uint64_t id) = 0;
  // Into the library; `row.in_library` is ignored. ALREADY_EXISTS for its id and for its name.
  virtual absl::Status PutKind(const KindRow& row, absl::string_view shape) = 0;
  // Of the library. ALREADY_EXISTS; nothing happens where there is no such kind.
  virtual absl::Status RenameKind(std::uint64_t id, absl::string_view name) = 0;
  virtual absl::Status DeleteKind(std::uint64_t id) = 0;
  // Inserts or replaces, with parameters and metrics.
  virtual absl::Status PutJob(const JobInfo& job) = 0;
  virtual absl::Status DeleteJob(std::uint64_t id) = 0;
  // Inserts or replaces.
  virtual absl::Status PutAttempt(const Attempt& attempt) = 0;
  virtual absl::Status DeleteAttempt(const WorkId& work) = 0;

  // Derived data. Rows of several versions may lie beside each other; readers see the newest up to
  // MapClock::tile_version.
  virtual absl::Status PutMlsTile(const MlsTileRow& row) = 0;
  virtual absl::Status PutSurfaceTile(const SurfaceTileRow& row) = 0;
  virtual absl::Status DeleteMlsTile(const TileKey& key) = 0;
  // Older rows of one tile.
  virtual absl::Status DeleteOlderMlsTiles(const TileKey& key, std::uint64_t version) = 0;
  // Rows of one tile that nobody who reads at `floor` or later can see.
  virtual absl::Status CollectSurfaceTile(const TileKey& key, std::uint64_t floor) = 0;
  // The same for all tiles.
  virtual absl::Status CollectAllSurfaceTiles(std::uint64_t floor) = 0;
  // In place of whatever is kept of the tile.
  virtual absl::Status PutPreparedTile(const PreparedTileRow& row) = 0;
  virtual absl::Status DeletePreparedTile(const TileKey& key) = 0;
  virtual absl::Status PutPlaneModelPart(std::uint64_t job,
                                         std::uint64_t part,
                                         absl::string_view bytes) = 0;
  virtual absl::Status DeletePlaneModel() = 0;
  // DeleteScan() of the last of `scans` deletes it.
  virtual absl::Status PutEntityPart(std::uint64_t job,
                                     const EntityPart& part,
                                     const std::vector<ScanNumber>& scans) = 0;
  // What was inferred of the entity that has the part's number, by others of its kind.
  virtual absl::Status PutInferredPart(std::uint64_t job,
                                       std::uint64_t kind,
                                       const EntityPart& part) = 0;
  // DeleteScan() deletes all parts of the kinds that the scan has seen.
  virtual absl::Status PutInferredScan(std::uint64_t kind, ScanNumber scan) = 0;
  virtual absl::Status DeleteInferred() = 0;
  // And the kinds that a job found, and what was inferred.
  virtual absl::Status DeleteEntities() = 0;
  // In place of one with this id; its name is ignored.
  virtual absl::Status PutFoundKind(const KindRow& row, absl::string_view shape) = 0;
  // Rows newer than the current version: an unfinished rebuild.
  virtual absl::Status DiscardUnpublished() = 0;
  virtual absl::Status SetTilesOfScan(ScanNumber number, const std::vector<TileKey>& tiles) = 0;
  virtual absl::Status SetFootprint(ScanNumber number, const Eigen::AlignedBox2d& footprint) = 0;
  virtual absl::Status PutScanView(ScanNumber number, const ScanView& view) = 0;
  // Removes relations, footprints and views of scans that are not there.
  virtual absl::Status DeleteOrphanIndexes() = 0;
  // Makes `version` the current one and, if `complete`, the derived data usable.
  virtual absl::Status PublishTiles(std::uint64_t version, bool complete) = 0;
  // Drops all derived data; MapClock::derived_complete becomes false.
  virtual absl::Status DropDerived() = 0;
};

// Who had a map alone before it was opened.
enum class LastOwner : std::uint8_t {
  kNobody,  // it was given up: no process died with it
  kSelf,    // this process, or the one before it in the same place
  kOther,   // another one, which has died, or is frozen or cut off: nobody here can tell
};

// One map's durable store.
class MapStorage {
 public:
  virtual ~MapStorage() = default;

  // Thread-safe; each reader is used by one thread at a time and must not outlive the storage.
  virtual absl::StatusOr<std::unique_ptr<StorageReader>> NewReader() = 0;
  virtual StorageWriter& writer() = 0;
  // UNAVAILABLE once what it was opened from was removed or replaced. Thread-safe.
  virtual absl::Status CheckInPlace() const = 0;
  // OK while nobody else can be writing it, as far as this process was to have it alone; from
  // memory, for every request. UNAVAILABLE with a retry delay: the store was not asked for too
  // long, others may write by now. MustBeOpenedAnew(): they do. Thread-safe.
  virtual absl::Status CheckHeld() const { return absl::OkStatus(); }
  virtual LastOwner last_owner() const { return LastOwner::kSelf; }
  // Tells the map from all that its store has or had, also under its name; 0: it has no other.
  virtual std::int64_t number() const { return 0; }
};

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_STORAGE_H_
