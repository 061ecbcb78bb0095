#include "core/storage/outcome.h"

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"

namespace strata {
namespace {

constexpr char kUrl[] = "strata/outcome_unknown";
constexpr char kTakenUrl[] = "strata/taken_away";

}  // namespace

absl::Status OutcomeUnknown(absl::string_view why) {
  absl::Status status = absl::UnavailableError(absl::StrCat(why, "; outcome unknown"));
  status.SetPayload(kUrl, absl::Cord());
  return status;
}

bool IsOutcomeUnknown(const absl::Status& status) { return status.GetPayload(kUrl).has_value(); }

absl::Status TakenAway(absl::string_view why) {
  absl::Status status = absl::UnavailableError(why);
  status.SetPayload(kTakenUrl, absl::Cord());
  return status;
}

bool MustBeOpenedAnew(const absl::Status& status) {
  return IsOutcomeUnknown(status) || status.GetPayload(kTakenUrl).has_value();
}

}  // namespace strata
