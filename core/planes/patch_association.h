// Which patches of which scans are one surface.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_PATCH_ASSOCIATION_H_
#define STRATA_CORE_PLANES_PATCH_ASSOCIATION_H_

#include <span>
#include <vector>

#include "core/planes/shared_planes.h"

namespace strata {

// The planes of patches, see FindSharedPlanes().
std::vector<SharedPlane> FindPatchPlanes(std::span<const PosedPlanes> scans,
                                         const SharedPlaneOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_PATCH_ASSOCIATION_H_
