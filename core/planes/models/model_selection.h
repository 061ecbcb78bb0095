// How many planes and main directions there are: the model of least BIC (thesis 5.4.1, 5.4.2).
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_MODELS_MODEL_SELECTION_H_
#define STRATA_CORE_PLANES_MODELS_MODEL_SELECTION_H_

#include <cstddef>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/random.h"
#include "core/common/stop.h"
#include "core/planes/models/plane_mixture.h"

namespace strata {

// kAny: a plane is left out or goes into another one. kNearlyOne: only into one within 8°.
enum class PlaneReduction { kAny, kNearlyOne };

// −2 L + (3 M + 2 K) ln N (5.19), N in independent measurements, 6 M where colours count; of two
// models the one with the lower is better. (Steps 4 and 5 of the thesis' sketch drop while it
// increases, a slip.)
double Bic(const PlaneMixture& mixture);
// What a plane adds to it, whatever it explains.
double PlanePrice(const PlaneMixture& mixture);

// Leaves out main directions, the best first, while that lowers the BIC. True if any left.
bool DropDirections(PlaneMixture& mixture);

// Leaves out planes while that lowers the BIC, without running EM in between. A plane goes, or it
// goes into another that is near: what two cells of one wall began becomes one plane. True if any
// left; the mixture is prepared again.
absl::StatusOr<bool> DropPlanes(PlaneMixture& mixture,
                                const Stop& stop,
                                PlaneReduction which = PlaneReduction::kAny);

// Draws cells that no plane explains, with a probability that grows with their distance from all
// planes, capped at 1 m, and adds the plane of their surroundings, with its normal as a direction,
// where that lowers the BIC. The planes added, at most `most`; the mixture is prepared again.
absl::StatusOr<std::size_t> AddPlanes(PlaneMixture& mixture,
                                      std::size_t most,
                                      SplitMix64& random,
                                      const Stop& stop);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_MODELS_MODEL_SELECTION_H_
