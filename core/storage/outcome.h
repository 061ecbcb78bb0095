// Commits of which nobody knows whether they took place, and stores that others have taken.
#ifndef STRATA_CORE_STORAGE_OUTCOME_H_
#define STRATA_CORE_STORAGE_OUTCOME_H_

#include "absl/status/status.h"
#include "absl/strings/string_view.h"

namespace strata {

// UNAVAILABLE, "`why`; outcome unknown", told apart from others by IsOutcomeUnknown(): what was
// written may be there or not. Whoever keeps in memory what a store holds has to read it again.
absl::Status OutcomeUnknown(absl::string_view why);
bool IsOutcomeUnknown(const absl::Status& status);

// UNAVAILABLE, `why`: another process writes the store now, or it was removed. Nothing was written.
absl::Status TakenAway(absl::string_view why);

// Of both: what is in memory of the store may not be what it holds, so it has to be opened anew.
bool MustBeOpenedAnew(const absl::Status& status);

}  // namespace strata

#endif  // STRATA_CORE_STORAGE_OUTCOME_H_
