// The planes of all squares together: what goes on in the next square is one plane, and what is
// perpendicular to one main direction says so.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_MODELS_JOINED_PLANES_H_
#define STRATA_CORE_PLANES_MODELS_JOINED_PLANES_H_

#include <cstddef>
#include <span>
#include <vector>

#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/planes/models/plane_model_finder.h"
#include "core/planes/models/square_planes.h"
#include "core/world/plane_model.h"

namespace strata {

struct JoinedPlane {
  SquarePlane sum;   // over the squares; `plane` with its main direction heeded
  ModelPlane model;  // without polygons
};

struct JoinedPlanes {
  std::vector<JoinedPlane> planes;  // by falling area, at least options.min_area_m2 each
  std::vector<MainDirection> directions;
};

// `squares`: of each, FindSquarePlanes(). Planes of different squares are joined where they touch
// and one plane fits both about as well as each its own.
absl::StatusOr<JoinedPlanes> JoinSquares(const std::vector<std::vector<SquarePlane>>& squares,
                                         const PlaneModelOptions& options,
                                         const Stop& stop);

// The same planes in their order, each with those that it owns: owners[m] is m itself or another
// one's owner. Their main directions anew.
absl::StatusOr<JoinedPlanes> WithOwned(JoinedPlanes joined,
                                       std::span<const std::size_t> owners,
                                       const PlaneModelOptions& options,
                                       const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_JOINED_PLANES_H_
