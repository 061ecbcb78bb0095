// Consecutive local maps as one bigger one (thesis 7.3.4): a long loop becomes a short one, and
// maps that overlap little overlap more.
#ifndef STRATA_CORE_POSEGRAPH_CLOSURES_POOLING_H_
#define STRATA_CORE_POSEGRAPH_CLOSURES_POOLING_H_

#include <cstddef>
#include <span>
#include <vector>

#include "core/geometry/pose.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

// Scans that follow each other on a trajectory; the last is also the first of the next pool. The
// frame of a pool is that of its first scan.
struct Pool {
  std::vector<std::size_t> nodes;  // at least one
};

// `trajectories`: nodes in the order they were driven, each node once. Pools of `size` ≥ 2 scans,
// the last of a trajectory of what is left.
std::vector<Pool> MakePools(std::span<const std::vector<std::size_t>> trajectories,
                            std::size_t size);

// The graph of scans as one of pools: terms between scans of different pools become terms between
// the pools they are in, those within one go, and pools that share a scan are held together by it.
PoseGraphProblem PoolGraph(const PoseGraphProblem& graph, std::span<const Pool> pools);

// The scans after their pools went to T_map_pool: each follows its pool, a shared one the later of
// its two.
std::vector<Pose> UnpoolPoses(std::span<const Pool> pools,
                              std::span<const Pose> T_map_pool,
                              std::span<const Pose> T_map_scan_before);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_CLOSURES_POOLING_H_
