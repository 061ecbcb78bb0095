#include "core/planning/tile_cache.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/hash/hash.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"

#include "core/common/status.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground/ground_window.h"
#include "core/planning/least_dangers.h"
#include "core/planning/packed_tile.h"
#include "core/planning/prepared_tile.h"
#include "core/planning/tile_source.h"

namespace strata {
namespace {

bool HasInferred(const TileVersions& versions) {
  return std::any_of(versions.begin(), versions.end(), [](std::uint64_t version) {
    return (version & kWithInferred) != 0;
  });
}

// Sources keep nothing that was prepared together with what was inferred.
absl::StatusOr<std::optional<std::string>> LoadPrepared(TileSource& source,
                                                        const TileKey& key,
                                                        const TileVersions& versions,
                                                        const RobotProfile& profile) {
  if (HasInferred(versions)) return std::optional<std::string>();
  return source.LoadPrepared(key, versions, profile);
}

}  // namespace

// One of the few preparations at a time.
class TileCache::Turn {
 public:
  explicit Turn(TileCache& cache) : cache_(cache) {
    absl::MutexLock lock(&cache.mutex_);
    ++cache.waiting_;
    cache.mutex_.Await(absl::Condition(&cache, &TileCache::MayPrepare));
    ++cache.preparing_;
    alone_ = --cache.waiting_ == 0;
  }
  ~Turn() {
    absl::MutexLock lock(&cache_.mutex_);
    --cache_.preparing_;
  }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

  // Whether nobody waited for its end when it began.
  bool alone() const { return alone_; }

 private:
  TileCache& cache_;
  bool alone_ = false;
};

TileVersions VersionsAround(TileSource& source, const TileKey& key) {
  TileVersions versions;
  for (int i = 0; i < 9; ++i) {
    const TileKey neighbour = Neighbour(key, i);
    versions[i] = source.Version(neighbour);
    const std::shared_ptr<const InferredTile> inferred = source.Inferred(neighbour);
    if (inferred == nullptr) continue;
    versions[i] = absl::HashOf(versions[i], inferred->version) | kWithInferred;
  }
  return versions;
}

absl::StatusOr<TileNeighbourhood> LoadAround(TileSource& source, const TileKey& key) {
  TileNeighbourhood tiles;
  for (int i = 0; i < 9; ++i) {
    const TileKey neighbour = Neighbour(key, i);
    if (source.Version(neighbour) == 0) continue;
    STRATA_ASSIGN_OR_RETURN(tiles[i], source.Load(neighbour));
    if (tiles[i] != nullptr && tiles[i]->key != neighbour) {
      return absl::InternalError(absl::StrCat(
          "tile ", neighbour.ToString(), " came with the key ", tiles[i]->key.ToString()));
    }
  }
  return tiles;
}

InferredNeighbourhood InferredAround(TileSource& source, const TileKey& key) {
  InferredNeighbourhood tiles;
  for (int i = 0; i < 9; ++i) tiles[i] = source.Inferred(Neighbour(key, i));
  return tiles;
}

absl::StatusOr<std::shared_ptr<const PreparedTile>> PrepareFrom(TileSource& source,
                                                                const TileKey& key,
                                                                const ProfileChecks& checks,
                                                                const ParallelLoop& loop) {
  STRATA_ASSIGN_OR_RETURN(const TileNeighbourhood tiles, LoadAround(source, key));
  if (tiles[kMiddleTile] == nullptr) return std::shared_ptr<const PreparedTile>();
  const GroundWindow window(tiles, checks.margin, checks.cell_size_m, InferredAround(source, key));
  return std::make_shared<const PreparedTile>(
      PrepareTile(*tiles[kMiddleTile], window, checks, loop));
}

TileCache::Key TileCache::KeyOf(const TileKey& key,
                                const TileVersions& versions,
                                const ProfileChecks& checks) {
  const RobotProfile& p = checks.profile;
  return {key,
          {p.radius_m, p.height_m, p.max_step_m, p.max_slope_rad, p.max_gap_m, p.max_roughness_m},
          HasInferred(versions)};
}

absl::StatusOr<std::shared_ptr<const PreparedTile>> TileCache::Get(TileSource& source,
                                                                   const TileKey& key,
                                                                   const ProfileChecks& checks) {
  if (source.Version(key) == 0) return nullptr;
  const TileVersions versions = VersionsAround(source, key);
  const Key cache_key = KeyOf(key, versions, checks);
  const std::shared_ptr<Entry> entry = FindOrInsert(cache_key, versions);
  absl::MutexLock lock(&entry->mutex);
  if (entry->tile == nullptr) {
    STRATA_ASSIGN_OR_RETURN(entry->tile, Make(source, cache_key, versions, checks));
    if (entry->tile == nullptr) return nullptr;
    absl::MutexLock books(&mutex_);
    // Who uses an evicted tile keeps it alive.
    if (entries_.Find(cache_key) == entry) {
      entries_.Put(cache_key, entry, sizeof(Entry) + entry->tile->memory_bytes());
    }
  }
  return entry->tile;
}

std::shared_ptr<const PreparedTile> TileCache::Unpack(TileSource& source,
                                                      const Key& key,
                                                      const TileVersions& versions,
                                                      const ProfileChecks& checks) {
  const absl::StatusOr<std::optional<std::string>> kept =
      LoadPrepared(source, key.tile, versions, checks.profile);
  if (!kept.ok() || !kept->has_value()) return nullptr;
  absl::StatusOr<PreparedTile> tile = UnpackTile(**kept, checks.cell_size_m);
  const bool usable = tile.ok() && tile->key == key.tile;
  absl::MutexLock lock(&mutex_);
  ++(usable ? statistics_.kept : statistics_.unusable);
  return usable ? std::make_shared<const PreparedTile>(*std::move(tile)) : nullptr;
}

absl::StatusOr<std::shared_ptr<const PreparedTile>> TileCache::Make(TileSource& source,
                                                                    const Key& key,
                                                                    const TileVersions& versions,
                                                                    const ProfileChecks& checks) {
  if (auto unpacked = Unpack(source, key, versions, checks)) return unpacked;
  const Turn turn(*this);
  STRATA_ASSIGN_OR_RETURN(
      std::shared_ptr<const PreparedTile> tile,
      PrepareFrom(source, key.tile, checks, turn.alone() ? loop_ : ParallelLoop()));
  if (tile == nullptr) return tile;
  absl::MutexLock lock(&mutex_);
  ++statistics_.prepared;
  return tile;
}

std::shared_ptr<const LeastDangers> TileCache::FindDangers(TileSource& source,
                                                           const TileKey& key,
                                                           const TileVersions& versions,
                                                           const ProfileChecks& checks) {
  const Key cache_key = KeyOf(key, versions, checks);
  std::shared_ptr<const Dangers> dangers = dangers_.Find(cache_key);
  if (dangers == nullptr || dangers->versions != versions) {
    const absl::StatusOr<std::optional<std::string>> kept =
        LoadPrepared(source, key, versions, checks.profile);
    if (!kept.ok() || !kept->has_value()) return nullptr;
    const auto unpacked = UnpackLeastDangers(**kept, checks.cell_size_m);
    if (!unpacked.ok() || unpacked->key != key) return nullptr;
    dangers = std::make_shared<const Dangers>(Dangers{versions, unpacked->least});
    dangers_.Put(cache_key, dangers, sizeof(Dangers));
  }
  return {dangers, &dangers->least};
}

std::shared_ptr<const LeastDangers> TileCache::KeptDangers(TileSource& source,
                                                           const TileKey& key,
                                                           const ProfileChecks& checks) {
  static const auto closed = [] {
    LeastDangers all;
    all.fill(kClosedBlock);
    return std::make_shared<const LeastDangers>(all);
  }();
  static const auto open = std::make_shared<const LeastDangers>();
  if (source.Version(key) == 0) return closed;
  std::shared_ptr<const LeastDangers> kept =
      FindDangers(source, key, VersionsAround(source, key), checks);
  return kept != nullptr ? kept : open;
}

bool TileCache::IsKept(TileSource& source, const TileKey& key, const ProfileChecks& checks) {
  return source.Version(key) != 0 &&
         FindDangers(source, key, VersionsAround(source, key), checks) != nullptr;
}

std::shared_ptr<TileCache::Entry> TileCache::FindOrInsert(const Key& key,
                                                          const TileVersions& versions) {
  absl::MutexLock lock(&mutex_);
  std::shared_ptr<Entry> entry = entries_.Find(key);
  if (entry != nullptr && entry->versions == versions) return entry;
  entry = std::make_shared<Entry>(versions);
  entries_.Put(key, entry, sizeof(Entry));
  return entry;
}

TileCache::Statistics TileCache::statistics() const {
  absl::MutexLock lock(&mutex_);
  Statistics statistics = statistics_;
  statistics.bytes = entries_.bytes();
  return statistics;
}

}  // namespace strata
