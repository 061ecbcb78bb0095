// Tiles in memory, as a planner's source.
#ifndef STRATA_TESTS_CORE_PLANNING_MEMORY_TILES_H_
#define STRATA_TESTS_CORE_PLANNING_MEMORY_TILES_H_

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/status.h"
#include "core/planning/ground/profile_checks.h"
#include "core/planning/packed_tile.h"
#include "core/planning/tile_cache.h"
#include "core/planning/tile_source.h"

namespace strata::testing {

class MemoryTiles : public TileSource {
 public:
  explicit MemoryTiles(std::vector<SurfaceTile> tiles) {
    for (SurfaceTile& tile : tiles) {
      const TileKey key = tile.key;
      tiles_[key] = std::make_shared<const SurfaceTile>(std::move(tile));
    }
  }

  absl::StatusOr<std::shared_ptr<const SurfaceTile>> Load(const TileKey& key) override {
    ++loads;
    if (!failure.ok()) return failure;
    const auto found = tiles_.find(key);
    return found == tiles_.end() ? nullptr : found->second;
  }
  std::uint64_t Version(const TileKey& key) override {
    const auto found = tiles_.find(key);
    return found == tiles_.end() ? 0 : found->second->version;
  }
  std::vector<TileKey> Keys() const {
    std::vector<TileKey> keys;
    for (const auto& [key, tile] : tiles_) keys.push_back(key);
    return keys;
  }

  int loads = 0;
  absl::Status failure;  // of every Load

 private:
  std::map<TileKey, std::shared_ptr<const SurfaceTile>> tiles_;
};

// The same of which some are kept prepared, as a map at rest keeps them.
class KeptTiles : public MemoryTiles {
 public:
  using MemoryTiles::MemoryTiles;

  absl::StatusOr<std::optional<std::string>> LoadPrepared(const TileKey& key,
                                                          const TileVersions& /*versions*/,
                                                          const RobotProfile& profile) override {
    const auto found = kept.find(key);
    return found == kept.end() || profile != profile_ ? std::optional<std::string>()
                                                      : found->second;
  }
  // Keeps all tiles for one profile.
  absl::Status Keep(const ProfileChecks& checks) {
    profile_ = checks.profile;
    for (const TileKey& key : Keys()) {
      STRATA_ASSIGN_OR_RETURN(const auto tile, PrepareFrom(*this, key, checks));
      kept[key] = PackTile(*tile, checks.cell_size_m);
    }
    return absl::OkStatus();
  }

  std::map<TileKey, std::string> kept;

 private:
  RobotProfile profile_;
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_PLANNING_MEMORY_TILES_H_
