// Lower bounds of path costs from a few patches whose distances to all others are known (ALT:
// A*, landmarks, triangle inequality).
#ifndef STRATA_CORE_PLANNING_LANDMARKS_H_
#define STRATA_CORE_PLANNING_LANDMARKS_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/hash_map.h"
#include "core/common/stop.h"
#include "core/mls/tile_key.h"
#include "core/planning/search.h"
#include "core/planning/search_space.h"
#include "core/planning/tile_cache.h"
#include "core/world/robot_profile.h"

namespace strata {

inline constexpr int kMaxLandmarks = 16;

// Distances from landmarks, for one snapshot and one profile. Immutable.
class Landmarks {
 public:
  // Distances from `count` landmarks, in [1, kMaxLandmarks], chosen farthest first in the largest
  // connected part of all that is reachable from patches of `tiles`; tiles that moves lead into are
  // taken in, so that the bounds hold. Takes 20 bytes a patch while it lasts, of no budget.
  static absl::StatusOr<std::shared_ptr<const Landmarks>> Make(SearchSpace& space,
                                                               const std::vector<TileKey>& tiles,
                                                               int count,
                                                               const Stop& stop);

  const RobotProfile& profile() const { return profile_; }
  // True if `source` has the very tiles the distances were measured on.
  bool Fits(TileSource& source) const;

  int count() const { return count_; }
  std::size_t memory_bytes() const;
  // The cost of each patch, in the order of PreparedTile, to the first landmark, then to the
  // second, and so on: what a search asks of one landmark lies together. Patches connected to a
  // landmark are connected to all; the rest has kUnreached. nullptr for a tile that has none.
  const std::uint32_t* Tile(const TileKey& key) const;

  static constexpr std::uint32_t kUnreached = 0xFFFFFFFFU;

 private:
  struct TileDistances {
    TileVersions versions{};
    std::vector<std::uint32_t> costs;
  };

  void Store(const SearchSpace& space, SearchWorkspace& workspace, int landmark);

  int count_ = 0;
  RobotProfile profile_;
  HashMap<TileKey, TileDistances> tiles_;
};

}  // namespace strata

#endif  // STRATA_CORE_PLANNING_LANDMARKS_H_
