// Planning on one map: the planner and what is kept of tiles between queries.
#ifndef STRATA_CORE_ENGINE_PLANS_MAP_PLANNER_H_
#define STRATA_CORE_ENGINE_PLANS_MAP_PLANNER_H_

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include <Eigen/Core>

#include "core/common/cache_budget.h"
#include "core/common/lru_cache.h"
#include "core/common/stop.h"
#include "core/engine/map/engine_options.h"
#include "core/engine/map/map_state.h"
#include "core/engine/objects/inferred_tiles.h"
#include "core/engine/plans/seen_spaces.h"
#include "core/engine/tiles/kept_tiles.h"
#include "core/mls/surface_tile.h"
#include "core/planning/planner.h"
#include "core/planning/tile_cache.h"
#include "core/world/exploration.h"
#include "core/world/floor.h"
#include "core/world/map_info.h"
#include "core/world/place.h"
#include "core/world/plan.h"
#include "core/world/shape.h"

namespace strata {

// Thread-safe. Every query reads the one state of the map that it is given, always of the same map.
class MapPlanner {
 public:
  // `parameters`: of the map; `caches`: of all maps.
  MapPlanner(std::string name,
             const MapParameters& parameters,
             const EngineOptions& options,
             const std::shared_ptr<CacheBudget>& caches);

  absl::StatusOr<PlanResult> Plan(MapState& state, const PlanQuery& query, const Stop& stop);
  // What changes follow is that of MapState::changes(), after `query.known` where there is one.
  absl::StatusOr<PathCheck> Check(MapState& state, const PathQuery& query, const Stop& stop);
  // As api::Planning::ListFloors. Made anew on each call, from prepared tiles as they are cached.
  absl::StatusOr<FloorPlan> Floors(MapState& state, const FloorQuery& query, const Stop& stop);
  // As api::Planning::ListPlaces. Made anew on each call.
  absl::StatusOr<FloorPlaces> Places(MapState& state, const PlaceQuery& query, const Stop& stop);
  // As api::Planning::Explore.
  absl::StatusOr<ExploreResult> Explore(MapState& state,
                                        const ExploreQuery& query,
                                        const Stop& stop);
  // As api::Planning::CheckShape.
  absl::StatusOr<ShapeCheck> CheckShape(MapState& state, const ShapeQuery& query, const Stop& stop);
  // INVALID_ARGUMENT for a place that is not finite.
  absl::StatusOr<std::vector<SurfaceColumn>> Sample(MapState& state,
                                                    const std::vector<Eigen::Vector2d>& places,
                                                    const Stop& stop);
  TileCache::Statistics cache_statistics() const { return planner_.cache_statistics(); }

 private:
  class Source;
  struct Decoded {
    std::uint64_t version = 0;
    std::shared_ptr<const SurfaceTile> tile;
  };

  absl::StatusOr<std::shared_ptr<const TileVersionMap>> VersionsOf(MapState& state);
  absl::StatusOr<std::shared_ptr<const SurfaceTile>> LoadTile(MapState& state,
                                                              const TileKey& key,
                                                              std::uint64_t version);
  // What the store keeps, unless it is damaged: that is noted.
  absl::StatusOr<std::optional<std::string>> LoadPrepared(MapState& state,
                                                          const TileKey& key,
                                                          const std::string& made_of);

  const std::string name_;
  const double cell_size_m_;
  Planner planner_;
  absl::Mutex mutex_;
  MapView versions_view_ ABSL_GUARDED_BY(mutex_);
  std::shared_ptr<const TileVersionMap> versions_ ABSL_GUARDED_BY(mutex_);
  SeenSpaces spaces_;
  InferredTiles inferred_;
  LruCache<TileKey, const Decoded> tiles_;  // of each what was asked for last
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_PLANS_MAP_PLANNER_H_
