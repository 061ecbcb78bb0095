// Planning on one map: the planner and what is kept of tiles between queries.
#ifndef STRATA_CORE_ENGINE_DOORS_MAP_PLANNER_H_
#define STRATA_CORE_ENGINE_DOORS_MAP_PLANNER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include <Eigen/Core>

#include "core/common/lru_cache.h"
#include "core/common/stop.h"
#include "core/engine/doors/seen_spaces.h"
#include "core/engine/map/map_core.h"
#include "core/engine/objects/inferred_tiles.h"
#include "core/engine/tiles/kept_tiles.h"
#include "core/mls/surface_tile.h"
#include "core/planning/planner.h"
#include "core/planning/tile_cache.h"
#include "core/world/exploration.h"
#include "core/world/floor.h"
#include "core/world/place.h"
#include "core/world/plan.h"
#include "core/world/shape.h"

namespace strata {

// Thread-safe. Every query reads one pinned state of the map.
class MapPlanner {
 public:
  explicit MapPlanner(MapCore& core);

  absl::StatusOr<PlanResult> Plan(const PlanQuery& query, const Stop& stop);
  absl::StatusOr<PathCheck> Check(const PathQuery& query, const Stop& stop);
  // As api::Planning::WatchPath.
  absl::Status Watch(const PathQuery& query,
                     const Stop& stop,
                     absl::FunctionRef<absl::Status(const PathCheck&)> sink);
  // As api::Planning::ListFloors. Made anew on each call, from prepared tiles as they are cached.
  absl::StatusOr<FloorPlan> Floors(const FloorQuery& query, const Stop& stop);
  // As api::Planning::ListPlaces. Made anew on each call.
  absl::StatusOr<FloorPlaces> Places(const PlaceQuery& query, const Stop& stop);
  // As api::Planning::Explore.
  absl::StatusOr<ExploreResult> Explore(const ExploreQuery& query, const Stop& stop);
  // As api::Planning::CheckShape.
  absl::StatusOr<ShapeCheck> CheckShape(const ShapeQuery& query, const Stop& stop);
  // INVALID_ARGUMENT for a place that is not finite.
  absl::StatusOr<std::vector<SurfaceColumn>> Sample(const std::vector<Eigen::Vector2d>& places,
                                                    const Stop& stop);
  TileCache::Statistics cache_statistics() const { return planner_.cache_statistics(); }

 private:
  class Source;
  struct Decoded {
    std::uint64_t version = 0;
    std::shared_ptr<const SurfaceTile> tile;
  };

  absl::StatusOr<std::shared_ptr<const TileVersionMap>> VersionsOf(const MapView& view);
  absl::StatusOr<std::shared_ptr<const SurfaceTile>> LoadTile(const TileKey& key,
                                                              std::uint64_t version);
  // What the store keeps, unless it is damaged: that is noted.
  absl::StatusOr<std::optional<std::string>> LoadPrepared(const TileKey& key,
                                                          const std::string& made_of);

  MapCore& core_;
  Planner planner_;
  absl::Mutex mutex_;
  MapView versions_view_ ABSL_GUARDED_BY(mutex_);
  std::shared_ptr<const TileVersionMap> versions_ ABSL_GUARDED_BY(mutex_);
  SeenSpaces spaces_;
  InferredTiles inferred_;
  LruCache<TileKey, const Decoded> tiles_;  // of each what was asked for last
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_DOORS_MAP_PLANNER_H_
