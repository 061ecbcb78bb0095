// Changes what is derived: takes scans into the tiles, moves and removes them. Every change is one
// transaction that also records the decision it follows from, so nothing half-done is ever read.
#ifndef STRATA_CORE_ENGINE_INGEST_INTEGRATOR_H_
#define STRATA_CORE_ENGINE_INGEST_INTEGRATOR_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/engine/ingest/aligner.h"
#include "core/engine/ingest/scan_mover.h"
#include "core/engine/ingest/scans_ahead.h"
#include "core/engine/map/map_core.h"
#include "core/engine/scans/scan_labels.h"
#include "core/engine/tiles/mls_tiles.h"
#include "core/engine/tiles/surface_tiles.h"
#include "core/world/robot_profile.h"
#include "core/world/scan.h"

namespace strata {

// Tiles that change, with everything that is served of them.
struct TileChange {
  std::uint64_t version = 0;
  MlsTileMap tiles;
  SurfaceTileMaker::Rows surfaces;
};

// Scans and what has faded of them, asked for when it is needed, from several threads.
struct FadingRequest {
  std::vector<ScanNumber> scans;
  absl::FunctionRef<LabelChange(const ScanRecord&)> change_of;
};

// One thread at a time: the worker's.
class Integrator {
 public:
  // What a commit does beside the change that it is made for; an error undoes both.
  using Decision = absl::FunctionRef<absl::Status(StorageWriter&)>;
  static absl::Status Nothing(StorageWriter&) { return absl::OkStatus(); }

  explicit Integrator(MapCore& core) : core_(core), aligner_(core.caches()), store_(core) {}

  // Integrates pending scans in commit order, at most `most_scans`, in transactions of
  // EngineOptions::max_batch_scans at most; after each it ends unless `goes_on`. Returns how many
  // (0: none is left). A scan that cannot be integrated is marked failed and counted; an error is
  // one of the store, and nothing has changed then. With more than one thread tiles of a
  // transaction are made and written while the scans of the next one are placed.
  absl::StatusOr<int> IntegratePending(int most_scans, absl::FunctionRef<bool()> goes_on);

  // In any state. NOT_FOUND.
  absl::Status DeleteScan(const ScanId& id, Decision also = Nothing);
  // NOT_FOUND; FAILED_PRECONDITION unless the scan is integrated. Begins a new epoch.
  absl::Status SetPose(const ScanId& id, const Pose& T_map_scan, Decision also = Nothing);
  // Begins a new epoch with other poses, as ScanMover does.
  absl::StatusOr<MoveOutcome> MoveScans(const ScanMoves& moves,
                                        int threads,
                                        JobContext& context,
                                        Decision decision);
  // What a person says of a scan in any state; `update`: a label that is 0 leaves what people said
  // before. NOT_FOUND; FAILED_PRECONDITION where the points were dropped; INVALID_ARGUMENT unless
  // there is a label for every point.
  absl::Status SetPersonLabels(const ScanId& id,
                               const std::vector<std::uint16_t>& labels,
                               bool update,
                               Decision also = Nothing);
  // What a classifier says of it; errors as above.
  absl::Status SetModelLabels(ScanNumber number,
                              std::uint64_t model,
                              std::vector<std::uint16_t> labels);
  // Which points of scans have faded; scans that are gone, not integrated or stored so already are
  // left out. Returns how many changed. All at once: nothing has changed after an error.
  absl::StatusOr<std::size_t> SetFaded(const FadingRequest& request, JobContext& context);
  // Annotates all tiles for another robot.
  absl::Status SetDefaultProfile(const RobotProfile& profile,
                                 const Stop& stop,
                                 Decision also = Nothing);

  MapCore& core() { return core_; }
  MlsTileStore& store() { return store_; }
  // What is kept in memory is read again: work was left in the middle.
  void ForgetCaches() {
    store_.Clear();
    aligner_loaded_ = false;
  }
  // The version of tiles that are about to be made and published: newer than all there have been.
  absl::StatusOr<std::uint64_t> NextVersion();

 private:
  struct Integrated {
    ScanRecord scan;
    Placement placement;
    std::vector<TileKey> tiles;
    std::string local_map;  // encoded; only if the points go
    std::string losses;     // which points are not in it
  };
  struct Failed {
    ScanNumber number;
    ScanId id;
    std::string message;
  };
  // Of one transaction.
  struct Batch {
    std::size_t scans = 0;
    std::vector<Integrated> integrated;
    std::vector<Failed> failed;
    TileChange change;
  };

  absl::Status LoadAlignerOnce(StorageReader& reader);
  // Counts the scans of the batches that were committed.
  absl::Status IntegrateBatches(std::span<const PosedScan> pending,
                                absl::FunctionRef<bool()> goes_on,
                                std::size_t& count);
  // With scans from `first` on. `behind`: the batch before, being published; or nullptr.
  absl::Status Fill(std::span<const PosedScan> pending,
                    std::size_t first,
                    const Batch* behind,
                    ScansAhead& scans,
                    Batch& batch);
  absl::Status IntegrateScan(const ScanRecord& scan,
                             absl::StatusOr<ReadyScan> ready,
                             StorageReader& reader,
                             const Batch* behind,
                             Batch& batch);
  absl::StatusOr<MlsTilePtr> TileOf(const TileKey& key,
                                    StorageReader& reader,
                                    std::uint64_t version,
                                    const Batch* behind);
  // These two beside all of the above.
  absl::Status PublishBatch(Batch& batch, int threads);
  absl::Status CommitBatch(const Batch& batch);
  // Stores the labels, and has the tiles of the scan count them.
  absl::Status ChangeLabels(StorageReader& reader,
                            const PosedScan& posed,
                            const LabelChange& change,
                            Decision also);
  // The tiles of the scan with the votes of its labels as they will be.
  absl::StatusOr<MlsTileMap> Revoted(StorageReader& reader,
                                     const PosedScan& posed,
                                     const LabelChange& change);
  // Fills in what is served of change.tiles, and of their neighbours if geometry changed.
  absl::Status MakeServed(StorageReader& reader,
                          TileChange& change,
                          int threads,
                          bool geometry = true);
  // Publishes `change` together with whatever `decision` writes; watchers learn of it and of
  // `scans`. As MapCore::Publish().
  absl::Status Commit(const TileChange& change,
                      const std::vector<ScanId>& scans,
                      Decision decision,
                      bool awaited = true);
  // The tiles of `keys` from all their scans but `without`.
  absl::StatusOr<MlsTileMap> TilesWithout(StorageReader& reader,
                                          const absl::btree_set<TileKey>& keys,
                                          ScanNumber without);
  std::uint64_t epoch() const { return core_.snapshots().current().epoch; }

  MapCore& core_;
  Aligner aligner_;
  bool aligner_loaded_ = false;
  MlsTileStore store_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_INTEGRATOR_H_
