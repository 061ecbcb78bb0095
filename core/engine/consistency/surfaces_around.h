// What a map has around places, collected out of its served tiles for robots that are followed.
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_SURFACES_AROUND_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_SURFACES_AROUND_H_

#include <compare>
#include <cstdint>
#include <memory>
#include <utility>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/lru_cache.h"
#include "core/common/stop.h"
#include "core/engine/map/map_core.h"
#include "core/engine/map/snapshots.h"
#include "core/engine/tiles/served_tiles.h"
#include "core/tracking/map_surfaces.h"

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

  // Both must outlive it.
  SurfacesAround(MapCore& core, ServedTiles& tiles)
      : core_(core), tiles_(tiles), known_(core.caches()) {}

  // As readers of `view`, which must be pinned, see it; never null. Tiles that are damaged are left
  // out.
  absl::StatusOr<Handle> Find(const PlaceKey& place, const MapView& view, const Stop& stop);
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
                                      const MapView& view,
                                      const Stop& stop);

  MapCore& core_;
  ServedTiles& tiles_;
  LruCache<Key, const MapSurfaces> known_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_SURFACES_AROUND_H_
