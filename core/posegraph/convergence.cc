#include "core/posegraph/convergence.h"

#include "absl/strings/string_view.h"

namespace strata {

absl::string_view ToString(PoseGraphTermination termination) {
  switch (termination) {
    case PoseGraphTermination::kConverged:
      return "converged";
    case PoseGraphTermination::kNothingToDo:
      return "nothing to do";
    case PoseGraphTermination::kMaxIterations:
      return "max iterations";
    case PoseGraphTermination::kNoProgress:
      return "no progress";
  }
  return "unknown";
}

}  // namespace strata
