// What an alignment is asked, checked and changed.
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_ALIGNMENT_ALIGNMENT_PROBLEM_H_
#define STRATA_CORE_POSEGRAPH_ALIGNMENT_ALIGNMENT_PROBLEM_H_

#include <vector>

#include "absl/status/status.h"

#include "core/posegraph/alignment/alignment.h"

namespace strata {

// INVALID_ARGUMENT for indices or poses that are none.
absl::Status CheckProblem(const AlignmentProblem& problem);

// Trajectories end before the nodes that are marked in `cut`, and go on as others; what was said or
// measured of the way across is taken out. Closures and given terms stay, and so does the word of
// robots, AlignmentProblem::odometry.
void CutBefore(const std::vector<bool>& cut, AlignmentProblem& problem);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_ALIGNMENT_ALIGNMENT_PROBLEM_H_
