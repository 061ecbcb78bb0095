// Makes everything derived again from truth, part by part, and tells what differs from the store.
#ifndef STRATA_CORE_ENGINE_REPAIR_DERIVED_PASS_H_
#define STRATA_CORE_ENGINE_REPAIR_DERIVED_PASS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/btree_set.h"
#include "absl/status/status.h"
#include <Eigen/Geometry>

#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/steady_view.h"
#include "core/engine/tiles/mls_tiles.h"
#include "core/engine/tiles/surface_tiles.h"
#include "core/storage/storage.h"
#include "core/world/robot_profile.h"

namespace strata {

// What the store keeps beside a scan so that it is found by place.
struct ScanIndex {
  std::vector<TileKey> tiles;  // empty unless integrated
  Eigen::AlignedBox2d footprint;
  friend bool operator==(const ScanIndex& a, const ScanIndex& b) {
    return a.tiles == b.tiles &&
           (a.footprint.isEmpty()
                ? b.footprint.isEmpty()
                : a.footprint.min() == b.footprint.min() && a.footprint.max() == b.footprint.max());
  }
};
using ScanIndexes = absl::btree_map<ScanNumber, ScanIndex>;

// Differences as they are found; `tiles` and `surfaces` hold what should be there.
struct DerivedDifferences {
  MlsTileMap tiles;
  SurfaceTileMaker::Rows surfaces;
  std::vector<ScanNumber> scans;  // whose ScanIndex differs
};

class DerivedSink {
 public:
  virtual ~DerivedSink() = default;
  // The pass reads what the sink has stored of earlier calls.
  virtual absl::Status Differs(const DerivedDifferences& differences) = 0;
};

// Memory: a block of tiles at a time.
class DerivedPass {
 public:
  struct Options {
    std::uint64_t epoch = 0;    // whose poses hold
    std::uint64_t version = 0;  // compares with rows as of it; new rows get it
    RobotProfile profile;       // what tiles are annotated for
    int threads = 1;            // results do not depend on it
    // What is read, for that many threads; nullptr: the present state, which must stay as it is but
    // for what the sink stores. So that runs on the worker's thread.
    const SteadyView* view = nullptr;
  };

  // All must outlive the pass. `store`: of the same state.
  DerivedPass(MapCore& core, MlsTileStore& store, const Options& options, JobContext& context)
      : core_(core), store_(store), options_(options), context_(context) {}

  absl::Status Run(DerivedSink& sink);

  // Indexes of every scan as they should be; complete after Run().
  const ScanIndexes& indexes() const { return indexes_; }
  std::size_t scans() const { return indexes_.size(); }
  std::size_t tiles() const { return tiles_; }

 private:
  using KeySet = absl::btree_set<TileKey>;

  absl::Status ListScans(StorageReader& reader);
  absl::Status IndexScans(StorageReader& reader, DerivedSink& sink);
  absl::Status CheckMlsTiles(StorageReader& reader, DerivedSink& sink);
  absl::Status CheckBlock(StorageReader& reader, const KeySet& keys, DerivedSink& sink);
  absl::Status CheckSurfaces(StorageReader& reader, DerivedSink& sink);

  MapCore& core_;
  MlsTileStore& store_;
  const Options options_;
  JobContext& context_;
  std::vector<PlacedScanRecord> placed_;  // integrated scans, by number
  ScanIndexes indexes_;
  absl::btree_map<TileKey, std::vector<std::size_t>> scans_of_tile_;  // indices into placed_
  KeySet stored_;  // level-0 tiles in the store that no scan explains
  std::size_t tiles_ = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_REPAIR_DERIVED_PASS_H_
