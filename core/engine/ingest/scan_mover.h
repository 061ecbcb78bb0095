// Many scans move at once: the tiles they leave and the tiles they come to are made again.
#ifndef STRATA_CORE_ENGINE_INGEST_SCAN_MOVER_H_
#define STRATA_CORE_ENGINE_INGEST_SCAN_MOVER_H_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/btree_set.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/engine/ingest/changed_scans.h"
#include "core/engine/ingest/tiles_ahead.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/engine/scans/damaged_scans.h"
#include "core/engine/tiles/mls_tiles.h"
#include "core/engine/tiles/staged_tiles.h"
#include "core/storage/storage.h"

namespace strata {

// Scans that get other poses, together one epoch.
struct ScanMoves {
  std::vector<ProposedPose> poses;  // of integrated scans, each once
  PoseOrigin origin = PoseOrigin::kOptimize;
  std::string reason;     // of the epoch, for people
  std::uint64_t job = 0;  // that asks for it; 0: none
  // Takes what is damaged: such scans get their poses, but are in no tile that is made again.
  // nullptr: one of them is DATA_LOSS, and nothing moves.
  DamagedScans* damaged = nullptr;
  const TilesAhead* ahead = nullptr;  // of these moves or most of them; nullptr: none
};

struct MoveOutcome {
  std::uint64_t epoch = 0;
  std::size_t tiles = 0;  // made again, of any level
};

// Builds one epoch, on the worker's thread. All must outlive the mover; `store` must be empty, and
// holds tiles of the epoch to come afterwards.
class ScanMover {
 public:
  ScanMover(MapCore& core,
            MlsTileStore& store,
            const ScanMoves& moves,
            std::uint64_t version,
            int threads,
            JobContext& context)
      : core_(core),
        store_(store),
        moves_(moves),
        threads_(threads),
        context_(context),
        epoch_(core.snapshots().current().epoch),
        version_(version),
        staged_(core, version) {}

  // Makes the tiles beside the current ones, then switches readers, in one transaction with
  // `decision`. Only tiles that moved scans touch, or did, are made. Nothing has changed after an
  // error.
  absl::StatusOr<MoveOutcome> Run(absl::FunctionRef<absl::Status(StorageWriter&)> decision);

 private:
  // What is ahead, if it still holds.
  const TilesAhead* Ahead() const;
  absl::Status MoveAll();
  // Keeps the tiles of damaged scans that stay where they are: all but those made again.
  absl::Status KeepOtherTiles(StorageReader& reader, const absl::btree_set<TileKey>& made);
  absl::Status PutMoves(StorageWriter& writer, std::uint64_t epoch) const;

  MapCore& core_;
  MlsTileStore& store_;
  const ScanMoves& moves_;
  const int threads_;
  JobContext& context_;
  const std::uint64_t epoch_;  // the current one
  const std::uint64_t version_;
  StagedTiles staged_;
  ChangedScans moved_;
  absl::btree_map<ScanNumber, std::vector<TileKey>> tiles_of_damaged_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_SCAN_MOVER_H_
