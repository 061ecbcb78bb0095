// Fewer points of a cloud, evenly over space.
#ifndef STRATA_CORE_REGISTRATION_CLOUDS_THINNING_H_
#define STRATA_CORE_REGISTRATION_CLOUDS_THINNING_H_

#include "core/cloud/point_cloud.h"

namespace strata {

// The centre of gravity of the points of each cube of `edge_m`, without columns and grid; origins
// are kept, points that are not finite left out. Cubes are larger where the cloud extends over more
// than two thousand million of them. A pure function. REQUIRES: 0.001 ≤ edge_m ≤ 1000, points as
// ValidateCloud() takes them.
PointCloud ThinCloud(const PointCloud& cloud, double edge_m);

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_CLOUDS_THINNING_H_
