#include "core/cloud/sensor_model.h"

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace strata {

absl::Status ValidateSensorModel(const SensorModel& model) {
  std::vector<std::string> faults;
  const auto check = [&faults](const char* name, double value, double low, double high) {
    if (value >= low && value <= high) return;
    faults.push_back(absl::StrCat(name, " = ", value, " is not in [", low, ", ", high, "]"));
  };
  check("sigma_m", model.sigma_m, 0.0005, 10.0);
  check("sigma_per_metre", model.sigma_per_metre, 0.0, 1.0);
  check("min_range_m", model.min_range_m, 0.0, 1e6);
  check("max_range_m", model.max_range_m, model.min_range_m, 1e6);
  if (faults.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("sensor model: ", absl::StrJoin(faults, "; ")));
}

}  // namespace strata
