// What a map has around places, collected out of its served tiles for robots that are followed.
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_SURFACES_AROUND_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_SURFACES_AROUND_H_

#include <compare>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/cache_budget.h"
#include "core/common/lru_cache.h"
#include "core/common/stop.h"
#include "core/engine/map/map_state.h"
#include "core/engine/map/snapshots.h"
#include "core/engine/tiles/served_tiles.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/tracking/map_surfaces.h"
#include "core/world/map_info.h"

namespace strata {

// A place of a grid that robots near it share; z in steps of its own.
struct PlaceKey {
  std::int64_t x = 0, y = 0, z = 0;
  friend bool operator==(const PlaceKey&, const PlaceKey&) = default;
};
// Not farther than kSurfacesSlackM on the ground.
PlaceKey NearestPlace(const Eigen::Vector3d& p_map);
Eigen::Vector3d CentreOf(const PlaceKey& place);

// Thread-safe. Keeps what fits the caches of all maps, however many robots there are.
class SurfacesAround {
 public:
  using Handle = std::shared_ptr<const MapSurfaces>;

  // `parameters`: of the map. `tiles`, which must outlive it: of one that is open here, or nullptr.
  SurfacesAround(const MapParameters& parameters,
                 const std::shared_ptr<CacheBudget>& caches,
                 ServedTiles* tiles = nullptr)
      : parameters_(parameters), tiles_(tiles), known_(caches) {}

  // As the map is in `state`; never null. Tiles that are damaged are left out.
  absl::StatusOr<Handle> Find(const PlaceKey& place, const MapState& state, const Stop& stop);
  // The same where it is in memory; nullptr where it is not.
  Handle FindAtHand(const PlaceKey& place, const MapView& view);

 private:
  struct Key {
    PlaceKey place;
    MapView view;
    friend bool operator==(const Key&, const Key&) = default;
    template <typename H>
    friend H AbslHashValue(H h, const Key& key) {
      return H::combine(std::move(h),
                        key.place.x,
                        key.place.y,
                        key.place.z,
                        key.view.epoch,
                        key.view.tile_version);
    }
  };

  absl::StatusOr<MapSurfaces> Collect(const Eigen::Vector3d& centre,
                                      const MapState& state,
                                      const Stop& stop);
  // nullopt: nothing is there. DATA_LOSS.
  absl::StatusOr<std::optional<SurfaceTile>> ReadTile(const TileKey& key, const MapState& state);

  const MapParameters parameters_;
  ServedTiles* const tiles_;
  LruCache<Key, const MapSurfaces> known_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_SURFACES_AROUND_H_
