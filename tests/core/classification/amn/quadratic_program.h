// The least of what LearnByCuttingPlanes() minimises, found another way.
#ifndef STRATA_TESTS_CORE_CLASSIFICATION_AMN_QUADRATIC_PROGRAM_H_
#define STRATA_TESTS_CORE_CLASSIFICATION_AMN_QUADRATIC_PROGRAM_H_

#include "absl/status/statusor.h"

#include "core/classification/amn/amn_learning.h"

namespace strata::testing {

// The quadratic program 9.7 as it stands, by an interior point method (Ipopt): exact for two
// classes, of the linear relaxation for more; for some 10,000 dual variables of edges.
// RESOURCE_EXHAUSTED if the solver gives up.
absl::StatusOr<AmnLearning> LearnByQuadraticProgram(const AmnTrainingSet& set,
                                                    const AmnLearningOptions& options);

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_CLASSIFICATION_AMN_QUADRATIC_PROGRAM_H_
