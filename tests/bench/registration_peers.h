// The peers, behind a door of our own: PCL's headers take long to compile.
#ifndef STRATA_TESTS_BENCH_REGISTRATION_PEERS_H_
#define STRATA_TESTS_BENCH_REGISTRATION_PEERS_H_

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata::bench {

enum class Peer { kIcp, kGicp };

// PCL 1.13 with its defaults but for a 0.25 m voxel filter on both clouds, matches up to 2 m, 50
// iterations and a stop at steps of 1e-6 (ICP).
Pose RegisterWithPcl(Peer peer,
                     const PointCloud& source,
                     const PointCloud& target,
                     const Pose& T_target_source_guess);

}  // namespace strata::bench

#endif  // STRATA_TESTS_BENCH_REGISTRATION_PEERS_H_
