#include "core/planning/tile_cache.h"

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"

#include "core/common/status.h"
#include "core/mls/tile_key.h"
#include "core/planning/ground_fit.h"
#include "core/planning/ground_window.h"
#include "core/planning/prepared_tile.h"
#include "core/planning/profile_checks.h"
#include "core/planning/tile_source.h"

namespace strata {
namespace {

TileKey Neighbour(const TileKey& key, int index) {
  return {key.level, key.x + index % 3 - 1, key.y + index / 3 - 1};
}

}  // namespace

TileVersions VersionsAround(TileSource& source, const TileKey& key) {
  TileVersions versions;
  for (int i = 0; i < 9; ++i) versions[i] = source.Version(Neighbour(key, i));
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

absl::StatusOr<std::shared_ptr<const PreparedTile>> TileCache::Get(TileSource& source,
                                                                   const TileKey& key,
                                                                   const ProfileChecks& checks) {
  const TileVersions versions = VersionsAround(source, key);
  if (versions[kMiddleTile] == 0) return nullptr;
  const RobotProfile& p = checks.profile;
  const Key cache_key = {
      key, {p.radius_m, p.height_m, p.max_step_m, p.max_slope_rad, p.max_gap_m, p.max_roughness_m}};
  const std::shared_ptr<Entry> entry = FindOrInsert(cache_key, versions);
  absl::MutexLock lock(&entry->mutex);
  if (entry->tile != nullptr) return entry->tile;
  STRATA_ASSIGN_OR_RETURN(const TileNeighbourhood tiles, LoadAround(source, key));
  if (tiles[kMiddleTile] == nullptr) return nullptr;
  const GroundWindow window(tiles, checks.margin, checks.cell_size_m);
  const auto fits = Fits(key, versions, window);
  auto tile = std::make_shared<PreparedTile>(PrepareTile(key, window, *fits, checks));
  tile->class_id = ClassesOf(*tile, *tiles[kMiddleTile]);
  entry->tile = tile;
  Account(cache_key, entry, tile->memory_bytes(), false);
  return tile;
}

std::shared_ptr<const std::vector<GroundFit>> TileCache::Fits(const TileKey& tile,
                                                              const TileVersions& versions,
                                                              const GroundWindow& window) {
  const Key key{tile, {}};
  const std::shared_ptr<Entry> entry = FindOrInsert(key, versions);
  absl::MutexLock lock(&entry->mutex);
  if (entry->fits == nullptr) {
    entry->fits = std::make_shared<const std::vector<GroundFit>>(FitTile(window));
    Account(key, entry, entry->fits->size() * sizeof(GroundFit), true);
  }
  return entry->fits;
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

// Who still uses an evicted tile keeps it alive.
void TileCache::Account(const Key& key,
                        const std::shared_ptr<Entry>& entry,
                        std::size_t bytes,
                        bool fits) {
  absl::MutexLock lock(&mutex_);
  ++(fits ? statistics_.fitted : statistics_.prepared);
  if (entries_.Find(key) != entry) return;  // evicted meanwhile
  entries_.Put(key, entry, sizeof(Entry) + bytes);
}

TileCache::Statistics TileCache::statistics() const {
  absl::MutexLock lock(&mutex_);
  Statistics statistics = statistics_;
  statistics.bytes = entries_.bytes();
  return statistics;
}

}  // namespace strata
