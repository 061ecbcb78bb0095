#include "client/cli/plan/driver_options.h"

#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

#include "client/cli/terminal/names.h"
#include "core/common/status.h"
#include "core/world/map_class.h"

namespace strata::cli {

PlanEndpoint EndpointOf(const std::vector<double>& numbers) {
  PlanEndpoint endpoint{.x_m = numbers[0], .y_m = numbers[1], .z_m = {}, .level = {}};
  if (numbers.size() == 3) endpoint.z_m = numbers[2];
  return endpoint;
}

void AddDriverOptions(CLI::App* verb, DriverOptions& options) {
  TakesName(verb->add_option("--profile", options.profile, "The map's robot profile to start from")
                ->capture_default_str(),
            kProfileNames);
  AddProfileOptions(verb, options.overrides);
  verb->add_option("--avoid",
                   options.avoid,
                   "Surfaces of a class, by its name or id, cost so many times as much (1 to 100), "
                   "or are never crossed; may be given several times")
      ->type_name("CLASS=FACTOR|CLASS=never")
      ->allow_extra_args(false);
  AddInferred(verb, options.inferred);
}

absl::StatusOr<ClassCosts> ClassCostsOf(Context& context,
                                        const std::string& map,
                                        const DriverOptions& options) {
  ClassCosts costs;
  if (options.avoid.empty()) return costs;
  STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> classes,
                          context.database.maps().ListClasses(context.call, map));
  for (const std::string& text : options.avoid) {
    const std::pair<std::string, std::string> sides = absl::StrSplit(text, absl::MaxSplits('=', 1));
    double factor = kForbiddenClass;
    if (sides.second != "never" && !absl::SimpleAtod(sides.second, &factor)) {
      return absl::InvalidArgumentError(
          absl::StrCat("--avoid ", text, ": expected CLASS=FACTOR or CLASS=never"));
    }
    STRATA_ASSIGN_OR_RETURN(const std::uint16_t id, ClassIdOf(classes, sides.first));
    costs[id] = factor;
  }
  STRATA_RETURN_IF_ERROR(ValidateClassCosts(costs));
  return costs;
}

absl::StatusOr<RobotProfile> ProfileOf(Context& context,
                                       const std::string& map,
                                       const DriverOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const auto profiles,
                          context.database.planning().ListProfiles(context.call, map));
  const auto profile = profiles.find(options.profile);
  if (profile == profiles.end()) {
    return absl::NotFoundError(absl::StrCat("map ", map, ": no profile ", options.profile));
  }
  return options.overrides.Over(profile->second);
}

}  // namespace strata::cli
