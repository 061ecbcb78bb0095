// The planes of one square: cells of surface, a start by region growing, EM, and the number of
// planes by BIC (thesis 5.4.2).
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_MODELS_SQUARE_PLANES_H_
#define STRATA_CORE_PLANES_MODELS_SQUARE_PLANES_H_

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/stop.h"
#include "core/geometry/primitives.h"
#include "core/planes/models/plane_colour.h"
#include "core/planes/models/plane_mixture.h"
#include "core/planes/models/plane_model_finder.h"

namespace strata {

// Frame: the caller's reference.
struct SquarePlane {
  Plane plane;
  LabColour colour = LabColour::Zero();
  std::vector<Voxel> voxels;  // where it has surface, ascending
  // Σ over its cells in the square.
  Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();  // of their area
  double measurements = 0.0;                          // independent ones
  double information = 0.0;                           // Σ n/ρ² [1/m²]
  std::uint64_t point_count = 0;
};

// Those with surface in the square. REQUIRES: points have colours if options.colour. Cells are
// relative to points.origin + shift.
absl::StatusOr<std::vector<SquarePlane>> FindSquarePlanes(const PosedPoints& points,
                                                          const PlanSquare& square,
                                                          const Eigen::Vector3d& reference,
                                                          const PlaneModelOptions& options,
                                                          const Stop& stop);

// EM, then fewer directions and planes, then more of what is unexplained, until nothing changes.
absl::Status FitMixture(std::size_t max_planes, PlaneMixture& mixture, const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_SQUARE_PLANES_H_
