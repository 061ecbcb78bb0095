// strata kind list|rename|export|import|delete
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "client/cli/objects/kind_files.h"
#include "client/cli/objects/kind_mesh.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/confirm.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/names.h"
#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "core/common/status.h"
#include "core/mesh/mesh_check.h"
#include "core/mesh/triangle_mesh.h"
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
  double voxel_m = 0.05;
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

absl::Status ExportMesh(Context& context, const KindOptionsOfVerb& options, const ThingKind& kind) {
  STRATA_ASSIGN_OR_RETURN(const MeshFormat format, MeshFormatOf(options.file));
  STRATA_ASSIGN_OR_RETURN(KindMesh made, MeshOfKind(context, options.map, kind, options.voxel_m));
  Json json = {{"file", options.file},
               {"id", KindIdText(kind.info.id)},
               {"name", kind.info.name},
               {"method", made.method},
               {"things", made.things},
               {"scans", made.scans},
               {"vertices", made.mesh.vertices.size()},
               {"triangles", made.mesh.triangles.size()},
               {"area_m2", AreaOf(made.mesh)},
               {"closed", CheckMesh(made.mesh).closed()}};
  Geometry geometry;
  geometry.normals = VertexNormals(made.mesh);
  geometry.vertices = std::move(made.mesh.vertices);
  geometry.triangles = std::move(made.mesh.triangles);
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, MeshBytes(format, geometry));
  STRATA_RETURN_IF_ERROR(WriteFileBytes(options.file, bytes));
  context.output.Object(json);
  return absl::OkStatus();
}

absl::Status ExportKind(Context& context, const KindOptionsOfVerb& options) {
  const bool mesh = MeshFormatOf(options.file).ok();
  if (!mesh) STRATA_RETURN_IF_ERROR(CheckKindFile(options.file));
  STRATA_ASSIGN_OR_RETURN(
      ThingKind kind, context.database.objects().GetKind(context.call, options.map, options.kind));
  if (mesh) return ExportMesh(context, options, kind);
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
  rename->add_option("NEW_NAME", options->name, "What it is called from now on")->required();
  CLI::App* out = verb("export",
                       "Write a kind to a file, for kind import into another map, or as a mesh of "
                       "what the scans saw of all its things",
                       "strata kind export campus golf golf.kind\n"
                       "  strata kind export campus golf golf.glb --voxel 0.04",
                       ExportKind);
  AddKindArgument(out, *options);
  out->add_option("FILE", options->file, "Where to, by its ending")
      ->type_name("FILE.(kind|ply|obj|stl|glb)")
      ->required();
  out->add_option("--voxel", options->voxel_m, "Edge of a voxel of the mesh [m]")
      ->check(CLI::Range(0.005, 1.0))
      ->capture_default_str();
  AddImport(verb, *options);
  CLI::App* remove = verb("delete",
                          "Take a kind out of the library; its things are of none then",
                          "strata kind delete campus golf --yes",
                          DeleteKind);
  AddKindArgument(remove, *options);
  AddYes(remove, options->yes);
}

}  // namespace strata::cli
