// strata profile set|list
#include <map>
#include <memory>
#include <string>

#include "absl/status/status.h"

#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/names.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct ProfileOptions {
  std::string map;
  std::string profile;
  ProfileOverrides overrides;
};

Json Row(const std::string& name, const RobotProfile& profile) {
  Json row = {{"name", name}};
  row.update(ToJson(profile));
  return row;
}

// What is not given stays as it was; a new profile starts from the map's default.
absl::Status Set(Context& context, const ProfileOptions& options) {
  api::Planning& planning = context.database.planning();
  STRATA_ASSIGN_OR_RETURN(const auto profiles, planning.ListProfiles(context.call, options.map));
  auto base = profiles.find(options.profile);
  if (base == profiles.end()) {
    base = profiles.find(std::string(api::kDefaultProfile));
  }
  const RobotProfile profile =
      options.overrides.Over(base == profiles.end() ? RobotProfile{} : base->second);
  STRATA_RETURN_IF_ERROR(planning.SetProfile(context.call, options.map, options.profile, profile));
  context.output.Object(Row(options.profile, profile));
  return absl::OkStatus();
}

absl::Status List(Context& context, const ProfileOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const auto profiles,
                          context.database.planning().ListProfiles(context.call, options.map));
  Json rows = Json::array();
  for (const auto& [name, profile] : profiles) {
    rows.push_back(Row(name, profile));
  }
  context.output.List(rows,
                      {{"name", "NAME"},
                       {"radius_m", "RADIUS"},
                       {"height_m", "HEIGHT"},
                       {"max_step_m", "STEP"},
                       {"max_slope_rad", "SLOPE"},
                       {"max_gap_m", "GAP"},
                       {"max_roughness_m", "ROUGHNESS"}});
  return absl::OkStatus();
}

}  // namespace

void AddProfileCommands(Commands& commands) {
  auto options = std::make_shared<ProfileOptions>();
  CLI::App* noun = commands.Noun(
      "profile", "Robots: what \"traversable\" means for whom", "strata profile list campus");
  CLI::App* set =
      commands.Verb(noun,
                    "set",
                    "Create or change a profile; what is not given stays. \"default\" is "
                    "the one the map's tiles are classified for",
                    "strata profile set campus segway --radius 0.35 --max-step 0.1",
                    [options](Context& context) { return Set(context, *options); });
  AddMapName(set, options->map);
  TakesName(set->add_option("PROFILE", options->profile, "Name of the profile")->required(),
            kProfileNames);
  AddProfileOptions(set, options->overrides);
  CLI::App* list = commands.Verb(noun,
                                 "list",
                                 "All profiles of a map",
                                 "strata profile list campus",
                                 [options](Context& context) { return List(context, *options); });
  AddMapName(list, options->map);
}

}  // namespace strata::cli
