// Which patches of which scans are one surface.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_PATCH_ASSOCIATION_H_
#define STRATA_CORE_PLANES_PATCH_ASSOCIATION_H_

#include <span>
#include <vector>

#include "core/planes/global_planes.h"

namespace strata {

// The planes of patches, see FindGlobalPlanes().
std::vector<GlobalPlane> FindPatchPlanes(std::span<const PosedPlanes> scans,
                                         const GlobalPlaneOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_PATCH_ASSOCIATION_H_
