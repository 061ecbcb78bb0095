// A shape along a way over the surfaces of a map.
#ifndef STRATA_CORE_COLLISION_SHAPE_WAY_H_
#define STRATA_CORE_COLLISION_SHAPE_WAY_H_

#include <memory>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"
#include "core/world/shape.h"
#include "core/world/things/inferred_tile.h"

namespace strata {

// nullptr where the map has no such tile.
using TileOf =
    absl::FunctionRef<absl::StatusOr<std::shared_ptr<const SurfaceTile>>(const TileKey& key)>;

// What was inferred in the tile; nullptr: nothing.
using InferredOf = absl::FunctionRef<std::shared_ptr<const InferredTile>(const TileKey& key)>;
inline std::shared_ptr<const InferredTile> NothingInferred(const TileKey& /*key*/) {
  return nullptr;
}

// Holds the shape against the surfaces of the cells below it, at every pose and between them at
// least every quarter of a cell of what its farthest point moves. A surface is a box as wide as its
// cell, down as far as it was seen, ± max(3 σ, 2 cm) where it is level; clearance_m is added all
// around; what was inferred is the same. Surfaces up to ground_m above the plane that the shape
// stands on are ground. Fills all of ShapeCheck but epoch and elapsed_ms; `inferred` of the query
// is for whoever gives `inferred_of`.
//   INVALID_ARGUMENT   the query; a way of more than kMaxShapeLooks looks
//   errors of `tile_of` and `stop`
absl::StatusOr<ShapeCheck> CheckShapeAlong(TileOf tile_of,
                                           double cell_size_m,
                                           const ShapeQuery& query,
                                           const Stop& stop,
                                           InferredOf inferred_of = NothingInferred);

}  // namespace strata

#endif  // STRATA_CORE_COLLISION_SHAPE_WAY_H_
