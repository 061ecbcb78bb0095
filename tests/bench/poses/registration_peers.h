// The peers, behind a door of our own: PCL's headers take long to compile.
#ifndef STRATA_TESTS_BENCH_REGISTRATION_PEERS_H_
#define STRATA_TESTS_BENCH_REGISTRATION_PEERS_H_

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"

namespace strata::bench {

enum class Peer { kIcp, kGicp };

// PCL 1.13 with its defaults but for a 0.25 m voxel filter on both clouds and matches up to 2 m.
// ICP stops as in the example of its class's documentation, which users copy: at most 50 iterations
// or a squared step below 1e-8, but without that example's fitness epsilon of 1 m², which is looser
// than the errors here. PCL's bare default is 10 iterations.
Pose RegisterWithPcl(Peer peer,
                     const PointCloud& source,
                     const PointCloud& target,
                     const Pose& T_target_source_guess);

}  // namespace strata::bench

#endif  // STRATA_TESTS_BENCH_REGISTRATION_PEERS_H_
