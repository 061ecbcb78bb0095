#include "core/mls/mls_parameters.h"

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace strata {

absl::Status ValidateMlsParameters(const MlsParameters& parameters) {
  std::vector<std::string> faults;
  const auto check = [&faults](const char* name, double value, double low, double high) {
    if (value >= low && value <= high) return;
    faults.push_back(absl::StrCat(name, " = ", value, " is not in [", low, ", ", high, "]"));
  };
  check("cell_size_m", parameters.cell_size_m, 0.01, 100.0);
  check("gap_size_m", parameters.gap_size_m, 0.01, 100.0);
  check("thickness_m", parameters.thickness_m, 0.001, 1.0);
  if (faults.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("map: ", absl::StrJoin(faults, "; ")));
}

}  // namespace strata
