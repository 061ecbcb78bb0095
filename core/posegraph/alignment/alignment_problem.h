// What an alignment is asked, checked and changed.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_ALIGNMENT_ALIGNMENT_PROBLEM_H_
#define STRATA_CORE_POSEGRAPH_ALIGNMENT_ALIGNMENT_PROBLEM_H_

#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>

#include "core/posegraph/alignment/alignment.h"

namespace strata {

// INVALID_ARGUMENT for indices or poses that are none.
absl::Status CheckProblem(const AlignmentProblem& problem);

// A point near the middle of the scans, a multiple of a kilometre [m]: moments of surfaces about
// the map's zero lose what they are about where that is far away, as it is in UTM. Multiples that
// are whole in binary, so that poses come back from there as they went.
Eigen::Vector3d FarMiddle(const AlignmentProblem& problem);

// In a map whose zero lies at `zero` of this one.
void MoveZero(const Eigen::Vector3d& zero, AlignmentProblem& problem);
void MoveZero(const Eigen::Vector3d& zero, AlignmentResult& result);

// Trajectories end before the nodes that are marked in `cut`, and go on as others; what was said or
// measured of the way across is taken out. Closures and given terms stay, and so does the word of
// robots, AlignmentProblem::odometry.
void CutBefore(const std::vector<bool>& cut, AlignmentProblem& problem);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_ALIGNMENT_ALIGNMENT_PROBLEM_H_
