#include "core/cloud/field_of_view.h"

#include <numbers>

#include "core/common/option_checks.h"

namespace strata {

absl::Status FieldOfView::Validate() const {
  constexpr double kUpright = 1.571;
  OptionChecks checks("sensor");
  checks.InRange("up_rad", up_rad, -kUpright, kUpright);
  checks.InRange("down_rad", down_rad, -kUpright, kUpright);
  checks.InRange("up_rad + down_rad", up_rad + down_rad, 0.0, 2 * kUpright);
  checks.InRange("width_rad", width_rad, 1e-6, 2 * std::numbers::pi + 1e-6);
  checks.InRange("rows", rows, 1, 1000);
  checks.InRange("columns", columns, 1, 10'000);
  checks.InRange("rows · columns", static_cast<double>(rows) * columns, 1, 1e6);
  checks.InRange("max_range_m", max_range_m, 0.1, 200.0);
  return checks.status();
}

}  // namespace strata
