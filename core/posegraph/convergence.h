// When an optimisation ends, and why it did.
#ifndef STRATA_CORE_POSEGRAPH_CONVERGENCE_H_
#define STRATA_CORE_POSEGRAPH_CONVERGENCE_H_

#include <cstdint>

#include "absl/strings/string_view.h"

namespace strata {

struct ConvergenceOptions {
  int max_iterations = 100;  // [1, 10000]; each solves one linear system
  // Ends when a step lowers the cost, and was expected to, by less than this share of it (or
  // than 1e-9); or when all further steps together would lower it by less than this share,
  // shrinking as the last two did. [0, 0.5]
  double cost_tolerance = 1e-7;
  // Ends when no number of a step (radians, metres) is larger. [0, 0.5]
  double step_tolerance = 1e-9;
};

enum class PoseGraphTermination : std::uint8_t {
  kConverged,      // by one of the tolerances
  kNothingToDo,    // no pose is free, or no term binds one
  kMaxIterations,  // the cost may still go down
  kNoProgress,     // no step, however short, lowers the cost
};
absl::string_view ToString(PoseGraphTermination termination);

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_CONVERGENCE_H_
