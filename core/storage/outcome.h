// Commits of which nobody knows whether they took place.
#ifndef STRATA_CORE_STORAGE_OUTCOME_H_
#define STRATA_CORE_STORAGE_OUTCOME_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace strata {

// UNAVAILABLE, "`why`; outcome unknown", told apart from others by IsOutcomeUnknown(): what was
// written may be there or not. Whoever keeps in memory what a store holds has to read it again.
absl::Status OutcomeUnknown(absl::string_view why);
bool IsOutcomeUnknown(const absl::Status& status);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_OUTCOME_H_
