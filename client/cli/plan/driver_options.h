// Who drives a path, as commands about paths are told.
#ifndef STRATA_CLIENT_CLI_PLAN_DRIVER_OPTIONS_H_
#define STRATA_CLIENT_CLI_PLAN_DRIVER_OPTIONS_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"

#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "core/world/plan.h"
#include "core/world/robot_profile.h"

namespace strata::cli {

struct DriverOptions {
  std::string profile = std::string(api::kDefaultProfile);
  ProfileOverrides overrides;
  std::vector<std::string> avoid;  // CLASS=FACTOR or CLASS=never
  InferredAs inferred = InferredAs::kIgnore;
};

// X,Y or X,Y,Z.
PlanEndpoint EndpointOf(const std::vector<double>& numbers);

// --profile, those of AddProfileOptions, --avoid, --inferred.
void AddDriverOptions(CLI::App* verb, DriverOptions& options);

// The map's profile of that name with what is overridden. NOT_FOUND.
absl::StatusOr<RobotProfile> ProfileOf(Context& context,
                                       const std::string& map,
                                       const DriverOptions& options);
// Classes by the map's table. INVALID_ARGUMENT, NOT_FOUND.
absl::StatusOr<ClassCosts> ClassCostsOf(Context& context,
                                        const std::string& map,
                                        const DriverOptions& options);

}  // namespace strata::cli

#endif  // STRATA_CLIENT_CLI_PLAN_DRIVER_OPTIONS_H_
