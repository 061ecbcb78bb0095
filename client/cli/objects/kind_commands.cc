// strata kind list|rename|export|import|delete
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "client/cli/objects/kind_files.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/confirm.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/names.h"
#include "core/common/status.h"
#include "core/world/map_class.h"
#include "core/world/things/kind.h"

namespace strata::cli {
namespace {

struct KindOptionsOfVerb {
  std::string map;
  std::string kind;
  std::string name;
  std::string class_name;
  std::string file;
  double scale = 1.0;
  bool yes = false;
};

Json KindJson(const KindInfo& kind, const std::vector<MapClass>& classes) {
  return {{"id", KindIdText(kind.id)},
          {"name", kind.name},
          {"class", ClassOf(classes, kind.class_id).name},
          {"class_id", kind.class_id},
          {"origin", std::string(ToString(kind.origin))},
          {"made", TimeText(kind.made)},
          {"size_m", ToJson(kind.size)},
          {"points", kind.points},
          {"triangles", kind.triangles},
          {"entities", kind.entities}};
}

absl::Status ShowKind(Context& context, const KindOptionsOfVerb& options, const KindInfo& kind) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> classes,
                          context.database.maps().ListClasses(context.call, options.map));
  Json json = KindJson(kind, classes);
  json.erase("entities");  // not counted
  context.output.Object(json);
  return absl::OkStatus();
}

absl::Status ListKinds(Context& context, const KindOptionsOfVerb& options) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<KindInfo> kinds,
                          context.database.objects().ListKinds(context.call, options.map));
  STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> classes,
                          context.database.maps().ListClasses(context.call, options.map));
  Json all = Json::array();
  for (const KindInfo& kind : kinds) all.push_back(KindJson(kind, classes));
  context.output.List(all,
                      {{"id", "ID"},
                       {"name", "NAME"},
                       {"class", "CLASS"},
                       {"origin", "ORIGIN"},
                       {"size_m", "SIZE"},
                       {"points", "POINTS"},
                       {"entities", "THINGS"}});
  return absl::OkStatus();
}

absl::Status RenameKind(Context& context, const KindOptionsOfVerb& options) {
  STRATA_ASSIGN_OR_RETURN(
      const KindInfo kind,
      context.database.objects().RenameKind(context.call, options.map, options.kind, options.name));
  return ShowKind(context, options, kind);
}

absl::Status ExportKind(Context& context, const KindOptionsOfVerb& options) {
  STRATA_ASSIGN_OR_RETURN(
      ThingKind kind, context.database.objects().GetKind(context.call, options.map, options.kind));
  STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> classes,
                          context.database.maps().ListClasses(context.call, options.map));
  const NewKind exported{
      kind.info.name, ClassOf(classes, kind.info.class_id).name, std::move(kind.shape)};
  STRATA_RETURN_IF_ERROR(WriteKindFile(options.file, exported));
  context.output.Object({{"file", options.file},
                         {"id", KindIdText(kind.info.id)},
                         {"name", exported.name},
                         {"class", exported.class_name},
                         {"points", exported.shape.points.size()}});
  return absl::OkStatus();
}

absl::Status ImportKind(Context& context, const KindOptionsOfVerb& options) {
  STRATA_ASSIGN_OR_RETURN(NewKind kind, ReadKindFile(options.file, options.scale));
  if (!options.name.empty()) kind.name = options.name;
  if (!options.class_name.empty()) kind.class_name = options.class_name;
  if (kind.name.empty() || kind.class_name.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(options.file,
                     " does not say what the kind is called, or of which class it is; say --name "
                     "and --class"));
  }
  STRATA_ASSIGN_OR_RETURN(const KindInfo info,
                          context.database.objects().ImportKind(context.call, options.map, kind));
  return ShowKind(context, options, info);
}

absl::Status DeleteKind(Context& context, const KindOptionsOfVerb& options) {
  STRATA_RETURN_IF_ERROR(Confirm(
      options.yes, absl::StrCat("Delete kind ", options.kind, " of map ", options.map, "?")));
  STRATA_RETURN_IF_ERROR(
      context.database.objects().DeleteKind(context.call, options.map, options.kind));
  context.output.Object({{"deleted", options.kind}});
  return absl::OkStatus();
}

void AddKindArgument(CLI::App* verb, KindOptionsOfVerb& options) {
  TakesName(
      verb->add_option("KIND", options.kind, "Its name, or the first digits of its id")->required(),
      kKindNames);
}

template <typename MapVerb>
void AddImport(const MapVerb& verb, KindOptionsOfVerb& options) {
  CLI::App* import = verb("import",
                          "Put a kind into the library, from kind export or a mesh (z up): the "
                          "next objects find looks for things of it",
                          "strata kind import campus golf.kind\n"
                          "  strata kind import campus golf.stl --scale 0.001 --class car --name "
                          "golf",
                          ImportKind);
  import->add_option("FILE", options.file, "A .kind file, or a mesh")
      ->type_name("FILE.(kind|stl|obj|ply)")
      ->required();
  import->add_option("--name", options.name, "What it is called; default: as in the .kind file");
  import->add_option("--class", options.class_name, "The class of its things, by name");
  import->add_option("--scale", options.scale, "Metres a unit of the mesh has")
      ->check(CLI::Range(1e-6, 1e6));
}

}  // namespace

void AddKindCommands(Commands& commands) {
  auto options = std::make_shared<KindOptionsOfVerb>();
  CLI::App* noun = commands.Noun(
      "kind", "Kinds of things: which of the cars are the same model", "strata kind list campus");
  const auto verb = MapVerbs(commands, noun, options);
  verb("list",
       "The kinds of things in a map: those in its library, then those that objects find found and "
       "nobody has named",
       "strata kind list campus",
       ListKinds);
  CLI::App* rename =
      verb("rename",
           "Give a kind a name; it is in the library from then on, and keeps name and id",
           "strata kind rename campus 3f09a1 golf",
           RenameKind);
  AddKindArgument(rename, *options);
  rename->add_option("NAME", options->name, "What it is called from now on")->required();
  CLI::App* out = verb("export",
                       "Write a kind to a file, for kind import into another map",
                       "strata kind export campus golf golf.kind",
                       ExportKind);
  AddKindArgument(out, *options);
  out->add_option("FILE", options->file, "Where to")->type_name("FILE.kind")->required();
  AddImport(verb, *options);
  CLI::App* remove = verb("delete",
                          "Take a kind out of the library; its things are of none then",
                          "strata kind delete campus golf --yes",
                          DeleteKind);
  AddKindArgument(remove, *options);
  AddYes(remove, options->yes);
}

}  // namespace strata::cli
