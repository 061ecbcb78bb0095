#include "core/world/robot_profile.h"

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace strata {

absl::Status ValidateRobotProfile(const RobotProfile& profile) {
  std::vector<std::string> faults;
  const auto check = [&faults](const char* name, double value, double low, double high) {
    if (value >= low && value <= high) return;
    faults.push_back(absl::StrCat(name, " = ", value, " is not in [", low, ", ", high, "]"));
  };
  check("radius_m", profile.radius_m, 0.0, 10.0);
  check("height_m", profile.height_m, 0.01, 100.0);
  check("max_step_m", profile.max_step_m, 0.0, 10.0);
  check("max_slope_rad", profile.max_slope_rad, 0.0, 1.5);
  check("max_gap_m", profile.max_gap_m, 0.0, 10.0);
  check("max_roughness_m", profile.max_roughness_m, 1e-6, 10.0);
  if (faults.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("profile: ", absl::StrJoin(faults, "; ")));
}

}  // namespace strata
