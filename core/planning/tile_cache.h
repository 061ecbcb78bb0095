// Prepared tiles, kept as long as they fit.
#ifndef STRATA_CORE_PLANNING_TILE_CACHE_H_
#define STRATA_CORE_PLANNING_TILE_CACHE_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"

#include "core/common/lru_cache.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/ground/rows.h"
#include "core/planning/least_dangers.h"
#include "core/planning/prepared_tile.h"
#include "core/planning/tile_source.h"

namespace strata {

// Tile `index` of the neighbourhoods and the TileVersions of `key`.
inline TileKey Neighbour(const TileKey& key, int index) {
  return {key.level, key.x + index % 3 - 1, key.y + index / 3 - 1};
}
TileVersions VersionsAround(TileSource& source, const TileKey& key);
// The tiles themselves; INTERNAL if the source gives another tile than asked for.
absl::StatusOr<TileNeighbourhood> LoadAround(TileSource& source, const TileKey& key);
InferredNeighbourhood InferredAround(TileSource& source, const TileKey& key);
// Prepares one tile as a cache does; nullptr where the map has nothing. Takes up to some 50 MB.
absl::StatusOr<std::shared_ptr<const PreparedTile>> PrepareFrom(TileSource& source,
                                                                const TileKey& key,
                                                                const ProfileChecks& checks,
                                                                const ParallelLoop& loop = {});

// Thread-safe. A tile of unchanged versions is prepared once, however many threads ask for it at
// the same time; of a tile and a profile only what was asked for last is kept, so that a map that
// changes takes no more than one that does not. Few tiles are prepared at a time: each takes up to
// some 50 MB while it is. Where others wait for that it takes one thread, so that those who search
// in tiles that are there have the other processors.
class TileCache {
 public:
  struct Statistics {
    std::uint64_t prepared = 0;  // preparations made so far, for any profile
    std::uint64_t kept = 0;      // had from what the source keeps
    std::uint64_t unusable = 0;  // kept, but not to be unpacked: prepared anew
    std::size_t bytes = 0;       // kept now
  };

  // REQUIRES: preparations ≥ 1, the tiles that are prepared at a time.
  explicit TileCache(const std::shared_ptr<CacheBudget>& budget,
                     ParallelLoop loop = {},
                     int preparations = 1)
      : max_bytes_(budget->max_bytes()),
        loop_(std::move(loop)),
        preparations_(preparations),
        entries_(budget),
        dangers_(budget) {}

  // The size of the budget.
  std::size_t max_bytes() const { return max_bytes_; }

  // nullptr where the map has nothing. Errors are those of the source, and INTERNAL for a tile that
  // breaks its contract.
  absl::StatusOr<std::shared_ptr<const PreparedTile>> Get(TileSource& source,
                                                          const TileKey& key,
                                                          const ProfileChecks& checks);
  // Of a tile that the source keeps prepared; of any other, whatever the cache holds, that all of
  // it is without danger, and where the map has nothing, that all is closed.
  std::shared_ptr<const LeastDangers> KeptDangers(TileSource& source,
                                                  const TileKey& key,
                                                  const ProfileChecks& checks);
  bool IsKept(TileSource& source, const TileKey& key, const ProfileChecks& checks);
  Statistics statistics() const;

 private:
  class Turn;

  struct Key {
    TileKey tile;
    std::array<double, 6> profile{};
    bool inferred = false;  // who minds what was inferred does not take the place of who does not
    friend bool operator==(const Key&, const Key&) = default;
    template <typename H>
    friend H AbslHashValue(H h, const Key& key) {
      return H::combine(std::move(h), key.tile, key.profile, key.inferred);
    }
  };
  struct Entry {
    explicit Entry(const TileVersions& of) : versions(of) {}
    const TileVersions versions;
    absl::Mutex mutex;  // held while the tile is made
    std::shared_ptr<const PreparedTile> tile ABSL_GUARDED_BY(mutex);
  };

  struct Dangers {
    TileVersions versions;
    LeastDangers least;
  };

  static Key KeyOf(const TileKey& key, const TileVersions& versions, const ProfileChecks& checks);
  // nullptr if the source does not keep the tile.
  std::shared_ptr<const LeastDangers> FindDangers(TileSource& source,
                                                  const TileKey& key,
                                                  const TileVersions& versions,
                                                  const ProfileChecks& checks);
  std::shared_ptr<Entry> FindOrInsert(const Key& key, const TileVersions& versions);
  // From what the source keeps of it; nullptr where that is nothing.
  std::shared_ptr<const PreparedTile> Unpack(TileSource& source,
                                             const Key& key,
                                             const TileVersions& versions,
                                             const ProfileChecks& checks);
  // nullptr where the map has nothing.
  absl::StatusOr<std::shared_ptr<const PreparedTile>> Make(TileSource& source,
                                                           const Key& key,
                                                           const TileVersions& versions,
                                                           const ProfileChecks& checks);

  bool MayPrepare() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_) {
    return preparing_ < preparations_;
  }

  const std::size_t max_bytes_;
  const ParallelLoop loop_;
  const int preparations_;
  mutable absl::Mutex mutex_;
  LruCache<Key, Entry> entries_ ABSL_GUARDED_BY(mutex_);
  LruCache<Key, const Dangers> dangers_;
  Statistics statistics_ ABSL_GUARDED_BY(mutex_);
  int waiting_ ABSL_GUARDED_BY(mutex_) = 0;
  int preparing_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_TILE_CACHE_H_
