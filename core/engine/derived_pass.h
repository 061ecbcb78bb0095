// Makes everything derived again from truth, part by part, and tells what differs from the store.
#ifndef STRATA_CORE_ENGINE_DERIVED_PASS_H_
#define STRATA_CORE_ENGINE_DERIVED_PASS_H_

#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/container/btree_set.h"
#include "absl/status/status.h"
#include <Eigen/Geometry>

#include "core/engine/integrator.h"
#include "core/engine/job_board.h"
#include "core/engine/mls_tiles.h"
#include "core/engine/surface_tiles.h"
#include "core/storage/storage.h"

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

// Memory: a block of tiles at a time. Runs on the worker's thread, so nothing changes meanwhile.
class DerivedPass {
 public:
  // Compares with rows as of `version`, which new rows get. Results do not depend on `threads`.
  DerivedPass(Integrator& integrator, std::uint64_t version, int threads, JobContext& context)
      : integrator_(integrator),
        core_(integrator.core()),
        version_(version),
        threads_(threads),
        context_(context) {}

  absl::Status Run(DerivedSink& sink);

  // Of every scan, as they should be; complete after Run().
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

  Integrator& integrator_;
  MapCore& core_;
  const std::uint64_t version_;
  const int threads_;
  JobContext& context_;
  std::vector<PlacedScanRecord> placed_;  // integrated scans, by number
  ScanIndexes indexes_;
  absl::btree_map<TileKey, std::vector<std::size_t>> scans_of_tile_;  // indices into placed_
  KeySet stored_;  // level-0 tiles in the store that no scan explains
  std::size_t tiles_ = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DERIVED_PASS_H_
