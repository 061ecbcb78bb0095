// Tiles in memory, as a planner's source.
#ifndef STRATA_TESTS_CORE_PLANNING_MEMORY_TILES_H_
#define STRATA_TESTS_CORE_PLANNING_MEMORY_TILES_H_

#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

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

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_PLANNING_MEMORY_TILES_H_
