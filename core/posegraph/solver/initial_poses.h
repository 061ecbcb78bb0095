// Where to start a graph of relative poses from when its file says nothing, or nothing good.
#ifndef STRATA_CORE_POSEGRAPH_SOLVER_INITIAL_POSES_H_
#define STRATA_CORE_POSEGRAPH_SOLVER_INITIAL_POSES_H_

#include <vector>

#include "core/geometry/pose.h"
#include "core/posegraph/planar_pose_graph.h"
#include "core/posegraph/pose_graph.h"

namespace strata {

// Both use the relative poses only, leave fixed nodes and the first node of every component without
// one where `problem` has them, and REQUIRE a valid problem.

// Composes relative poses along a spanning tree that prefers neighbours by number: odometry.
std::vector<Pose> OdometryPoses(const PoseGraphProblem& problem);
std::vector<PlanarPose> OdometryPoses(const PlanarPoseGraph& graph);

// The chordal relaxation (Martinec and Pajdla 2007; Carlone et al. 2015): rotation matrices as a
// linear problem without their constraints, then brought to the nearest rotations, then the linear
// problem of the translations. Needs no start and is near the optimum for moderate noise; false
// closures spoil it.
std::vector<Pose> ChordalPoses(const PoseGraphProblem& problem);
std::vector<PlanarPose> ChordalPoses(const PlanarPoseGraph& graph);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_SOLVER_INITIAL_POSES_H_
