#include "core/storage/outcome.h"

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"

namespace strata {
namespace {

constexpr char kUrl[] = "strata/outcome_unknown";

}  // namespace

absl::Status OutcomeUnknown(absl::string_view why) {
  absl::Status status = absl::UnavailableError(absl::StrCat(why, "; outcome unknown"));
  status.SetPayload(kUrl, absl::Cord());
  return status;
}

bool IsOutcomeUnknown(const absl::Status& status) { return status.GetPayload(kUrl).has_value(); }

}  // namespace strata
