// The labels that fit a network best (thesis 9.2.1, maximising eq. 9.5).
#ifndef STRATA_CORE_CLASSIFICATION_AMN_AMN_INFERENCE_H_
#define STRATA_CORE_CLASSIFICATION_AMN_AMN_INFERENCE_H_

#include <vector>

#include "absl/status/statusor.h"

#include "core/classification/amn/amn.h"
#include "core/common/stop.h"

namespace strata {

struct AmnLabels {
  std::vector<ClassIndex> labels;
  double score = 0.0;
  int sweeps = 0;  // of α-expansion over all classes; 0: one cut decided
};

// Two classes: exactly, by a minimum cut. More: by α-expansion (Boykov, Veksler, Zabih 2001), from
// the best label of every point by itself, until no class can be expanded; never worse than that
// start. Deterministic. Errors are those of `stop`.
absl::StatusOr<AmnLabels> MaximizeScore(const AmnProblem& problem, const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_CLASSIFICATION_AMN_AMN_INFERENCE_H_
