#include "client/cli/mesh/mesh_commands.h"

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "client/cli/mesh/mesh_maker.h"
#include "client/cli/mesh/mesh_options.h"
#include "client/cli/mesh/scan_clouds.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/json.h"
#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "core/common/status.h"
#include "core/mesh/mesh_check.h"
#include "core/mesh/simplification.h"
#include "core/mesh/triangle_mesh.h"

namespace strata::cli {
namespace {

Json ReportOf(const MadeMesh& made, const MeshCheck& check, const MeshOptions& options) {
  Json json = {{"file", options.out}, {"method", options.method}};
  if (options.method != "organised") json["voxel_m"] = options.voxel_m;
  if (made.alpha_m2.has_value()) json["alpha_m2"] = *made.alpha_m2;
  json["points"] = made.points;
  json["vertices"] = made.mesh.vertices.size();
  json["triangles"] = made.mesh.triangles.size();
  json["area_m2"] = AreaOf(made.mesh);
  json["closed"] = check.closed();
  if (check.closed()) json["volume_m3"] = VolumeOf(made.mesh);
  json["boundary_edges"] = check.boundary_edges;
  json["nonmanifold_edges"] = check.nonmanifold_edges;
  json["euler_characteristic"] = check.euler_characteristic;
  json["coloured"] = !made.mesh.colour.empty();
  json["relative_to"] = ToJson(options.relative_to);
  return json;
}

absl::Status Write(TriangleMesh mesh, MeshFormat format, const MeshOptions& options, Json& report) {
  Geometry geometry;
  geometry.normals = VertexNormals(mesh);
  geometry.vertices = std::move(mesh.vertices);
  geometry.triangles = std::move(mesh.triangles);
  geometry.colour = std::move(mesh.colour);
  for (Eigen::Vector3d& v : geometry.vertices) v -= options.relative_to;
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, MeshBytes(format, geometry));
  report["bytes"] = bytes.size();
  return WriteFileBytes(options.out, bytes);
}

absl::Status Mesh(Context& context, const MeshOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const MeshFormat format, MeshFormatOf(options.out));
  STRATA_ASSIGN_OR_RETURN(const ScanClouds clouds, ScanClouds::Find(context, options));
  STRATA_ASSIGN_OR_RETURN(MadeMesh made, MakeMesh(context, clouds, options));
  if (options.simplify.has_value()) made.mesh = Simplify(std::move(made.mesh), *options.simplify);
  STRATA_RETURN_IF_ERROR(ColourMesh(context, clouds, options, made.mesh));
  Json report = ReportOf(made, CheckMesh(made.mesh), options);
  report["scans"] = clouds.size();
  STRATA_RETURN_IF_ERROR(Write(std::move(made.mesh), format, options, report));
  context.output.Object(report);
  return absl::OkStatus();
}

void AddSharedOptions(CLI::App* app, const std::shared_ptr<MeshOptions>& options) {
  app->add_option("FILE", options->out, "The mesh to write, by its ending: .ply, .obj, .stl, .glb")
      ->required();
  app->add_option("--voxel",
                  options->voxel_m,
                  "Edge of a voxel [m]: of what is smaller than two nothing remains; points of "
                  "an alpha shape are so far apart")
      ->check(CLI::Range(0.001, 10.0))
      ->capture_default_str();
  app->add_option(
      "--class", options->class_name, "Points of this class of the map only, or its id");
  app->add_option(
         "--simplify", options->simplify, "Collapse edges until there are no more triangles")
      ->check(CLI::Range(std::size_t{4}, std::size_t{1'000'000'000}))
      ->type_name("TRIANGLES");
  AddNumbers(
      app,
      "--relative-to",
      "X,Y,Z",
      3,
      3,
      [options](const std::vector<double>& n) {
        options->relative_to = {n[0], n[1], n[2]};
      },
      "Coordinates relative to this place, for maps far from their origin [m]");
}

constexpr char kMethods[] =
    "tsdf: signed distance to what the scans saw, without what others look through, open where "
    "nothing was seen (not for clouds merged of several scans, which no sensor saw); contour: "
    "closed around the points, two voxels thick; alpha: the points "
    "themselves, joined";

}  // namespace

void AddMapMesh(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<MeshOptions>();
  CLI::App* app = commands.Verb(
      noun,
      "mesh",
      "Write the surface of a map's scans as triangles, for simulators, viewers and CAD",
      "strata map mesh campus yard.glb --region 0,0,20,15 --voxel 0.05 --simplify 200000",
      [options](Context& context) { return Mesh(context, *options); });
  AddMapName(app, options->map);
  AddSharedOptions(app, options);
  app->add_option("--method", options->method, kMethods)
      ->check(CLI::IsMember({"tsdf", "contour", "alpha"}))
      ->capture_default_str();
  AddRegion(app, options->region);
}

void AddScanMesh(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<MeshOptions>();
  options->one_scan = true;
  CLI::App* app =
      commands.Verb(noun,
                    "mesh",
                    "Write the surface that one scan saw as triangles, in the frame of the scan",
                    "strata scan mesh campus segway/12 scan.ply --method organised",
                    [options](Context& context) { return Mesh(context, *options); });
  AddMapName(app, options->map);
  AddScanId(app, options->scan);
  AddSharedOptions(app, options);
  app->add_option("--method",
                  options->method,
                  std::string(kMethods) +
                      "; organised: neighbours in the rows and columns of the scan, if it has any")
      ->check(CLI::IsMember({"tsdf", "organised", "contour", "alpha"}))
      ->capture_default_str();
}

}  // namespace strata::cli
