// strata map classes
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

#include "client/cli/map/map_files.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/json.h"
#include "core/common/status.h"
#include "core/world/map_class.h"

namespace strata::cli {
namespace {

constexpr char kShape[] = "ID=NAME[:#RRGGBB]";

// A class as the command line gives it; without a colour, it keeps the one it has.
struct WantedClass {
  MapClass map_class;
  bool has_colour = false;
};

struct ClassesOptions {
  std::string map;
  std::vector<std::string> texts;
  std::vector<WantedClass> wanted;
};

bool ParseColour(const std::string& text, Colour& colour) {
  if (text.size() != 7 || text[0] != '#' ||
      text.find_first_not_of("0123456789abcdefABCDEF", 1) != std::string::npos) {
    return false;
  }
  const std::string bytes = absl::HexStringToBytes(text.substr(1));
  colour = {static_cast<std::uint8_t>(bytes[0]),
            static_cast<std::uint8_t>(bytes[1]),
            static_cast<std::uint8_t>(bytes[2])};
  return true;
}

WantedClass ParseClass(const std::string& text) {
  const std::pair<std::string, std::string> sides = absl::StrSplit(text, absl::MaxSplits('=', 1));
  const std::pair<std::string, std::string> right =
      absl::StrSplit(sides.second, absl::MaxSplits(':', 1));
  WantedClass wanted;
  wanted.has_colour = absl::StrContains(sides.second, ':');
  wanted.map_class.name = right.first;
  std::uint32_t id = 0;
  if (!absl::SimpleAtoi(sides.first, &id) || id > kMaxClassId ||
      (wanted.has_colour && !ParseColour(right.second, wanted.map_class.colour))) {
    throw CLI::ValidationError("--set", absl::StrCat("expected ", kShape, ", got ", text));
  }
  wanted.map_class.id = static_cast<std::uint16_t>(id);
  const absl::Status valid = ValidateMapClass(wanted.map_class);
  if (!valid.ok()) throw CLI::ValidationError("--set", std::string(valid.message()));
  return wanted;
}

absl::Status Classes(Context& context, const ClassesOptions& options) {
  api::Maps& maps = context.database.maps();
  STRATA_ASSIGN_OR_RETURN(std::vector<MapClass> classes,
                          maps.ListClasses(context.call, options.map));
  for (WantedClass wanted : options.wanted) {
    const std::uint16_t id = wanted.map_class.id;
    if (!wanted.has_colour) wanted.map_class.colour = ClassOf(classes, id).colour;
    STRATA_RETURN_IF_ERROR(maps.SetClass(context.call, options.map, wanted.map_class));
  }
  STRATA_ASSIGN_OR_RETURN(classes, maps.ListClasses(context.call, options.map));
  Json rows = Json::array();
  for (const MapClass& map_class : classes) rows.push_back(ToJson(map_class));
  context.output.List(rows, {{"id", "ID"}, {"name", "NAME"}, {"colour", "COLOUR"}});
  return absl::OkStatus();
}

}  // namespace

void AddMapClasses(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<ClassesOptions>();
  CLI::App* classes =
      commands.Verb(noun,
                    "classes",
                    "The classes of a map: what labels mean. Names them first, with --set",
                    "strata map classes campus --set 1=ground --set '2=facade:#c08040'",
                    [options](Context& context) { return Classes(context, *options); });
  AddMapName(classes, options->map);
  classes->add_option("--set", options->texts, "Name a class, or give it another name or colour")
      ->type_name(kShape)
      ->allow_extra_args(false);
  classes->parse_complete_callback([options] {
    for (const std::string& text : options->texts) options->wanted.push_back(ParseClass(text));
  });
}

}  // namespace strata::cli
