// Collects every violated bound of an options struct.
#ifndef STRATA_CORE_COMMON_OPTION_CHECKS_H_
#define STRATA_CORE_COMMON_OPTION_CHECKS_H_

#include <string>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"

namespace strata {

class OptionChecks {
 public:
  // `what` begins the message.
  explicit OptionChecks(absl::string_view what) : what_(what) {}

  void InRange(absl::string_view field, double value, double low, double high) {
    if (value >= low && value <= high) return;
    absl::StrAppend(&violations_,
                    violations_.empty() ? "" : "; ",
                    field,
                    " is ",
                    value,
                    ", must be in [",
                    low,
                    ", ",
                    high,
                    "]");
  }

  // OK, or INVALID_ARGUMENT naming all violations.
  absl::Status status() const {
    if (violations_.empty()) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat(what_, ": ", violations_));
  }

 private:
  std::string what_;
  std::string violations_;
};

}  // namespace strata

#endif  // STRATA_CORE_COMMON_OPTION_CHECKS_H_
