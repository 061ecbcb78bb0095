// Planes through edges of several scans (thesis 5.2.3, 7.4.2).
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_EDGE_PLANES_H_
#define STRATA_CORE_PLANES_EDGE_PLANES_H_

#include <span>
#include <vector>

#include "core/planes/shared_planes.h"

namespace strata {

// The planes of edges, see FindSharedPlanes(). Beyond the thesis, a plane needs three different
// lines (two are always nearly in some plane), and three times the support of the corridors beside
// it (where there are edges everywhere, every corridor holds some).
std::vector<SharedPlane> FindEdgePlanes(std::span<const PosedPlanes> scans,
                                        const SharedPlaneOptions& options);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_EDGE_PLANES_H_
