// strata map export
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

#include "client/cli/map/floor_files.h"
#include "client/cli/map/height_files.h"
#include "client/cli/map/map_files.h"
#include "client/cli/map/octree_files.h"
#include "client/cli/map/tile_source.h"
#include "client/cli/picture/map_picture.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"
#include "client/formats/file_bytes.h"
#include "client/formats/foxglove/foxglove_file.h"
#include "client/formats/geometry_writer.h"
#include "core/common/status.h"
#include "core/mls/surface_mesh.h"
#include "core/mls/traversability.h"

namespace strata::cli {
namespace {

struct ExportOptions {
  std::string map;
  std::string format;
  std::string out;
  std::string layer = "traversability";
  std::int32_t level = 0;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  FloorOptions floor;
  std::string mode = "trinary";
  HeightOptions heights;
  bool free = false;
  const CLI::App* given = nullptr;  // what the user said of these
};

Colour TraversabilityColour(const Surface& surface) {
  switch (surface.traversability) {
    case Traversability::kTraversable:
      return picture::kTraversableColour;
    case Traversability::kNonTraversable:
      return surface.vertical() ? picture::kVerticalColour : picture::kNonTraversableColour;
    case Traversability::kUnknown:
    case Traversability::kUnderside:
      break;
  }
  return surface.vertical() ? picture::kVerticalColour : picture::kUnknownColour;
}

Colour OwnColour(const Surface& surface) {
  return surface.coloured() ? surface.colour : picture::kUnknownColour;
}

// Where too little lies around a surface, it is level.
std::vector<Eigen::Vector3f> NormalsOf(const std::vector<SurfaceTile>& tiles, double cell_size_m) {
  std::map<TileKey, const SurfaceTile*> by_key;
  for (const SurfaceTile& tile : tiles) by_key[tile.key] = &tile;
  std::vector<Eigen::Vector3f> normals;
  for (const SurfaceTile& tile : tiles) {
    SurfaceNeighbourhood around{};
    for (int i = 0; i < 9; ++i) {
      const auto found =
          by_key.find({tile.key.level, tile.key.x + i % 3 - 1, tile.key.y + i / 3 - 1});
      if (found != by_key.end()) around[i] = found->second;
    }
    for (const Eigen::Vector3f& normal : EstimateNormals(tile, around, cell_size_m)) {
      normals.push_back(normal.isZero() ? Eigen::Vector3f::UnitZ() : normal);
    }
  }
  return normals;
}

// No labels rather than none but zeros.
void DropIfNone(std::vector<std::uint16_t>& labels) {
  if (std::all_of(labels.begin(), labels.end(), [](auto label) { return label == 0; })) {
    labels.clear();
  }
}

// Vertical segments become lines down to a vertex of their own.
// `cell_size_m` is that of level 0, the tiles are of level `level`.
Geometry GeometryOf(const std::vector<SurfaceTile>& tiles,
                    double cell_size_m,
                    int level,
                    bool own_colours) {
  std::vector<const SurfaceTile*> pointers;
  pointers.reserve(tiles.size());
  for (const SurfaceTile& tile : tiles) pointers.push_back(&tile);
  SurfaceMesh mesh = MakeSurfaceMesh(pointers, cell_size_m);
  Geometry geometry;
  geometry.normals = NormalsOf(tiles, std::ldexp(cell_size_m, level));
  geometry.vertices = std::move(mesh.vertices);
  geometry.triangles = std::move(mesh.triangles);
  geometry.lines = std::move(mesh.lines);
  for (const SurfaceTile& tile : tiles) {
    for (const Surface& surface : tile.surfaces) {
      geometry.colour.push_back(own_colours ? OwnColour(surface) : TraversabilityColour(surface));
      geometry.label.push_back(surface.class_id);
    }
  }
  for (const auto& [a, b, c, d] : mesh.quads) {
    geometry.triangles.push_back({a, b, c});
    geometry.triangles.push_back({a, c, d});
  }
  for (const SurfaceMesh::VerticalSegment& segment : mesh.verticals) {
    Eigen::Vector3d foot = geometry.vertices[segment.vertex];
    foot.z() = segment.bottom_m;
    geometry.lines.push_back(
        {segment.vertex, static_cast<std::uint32_t>(geometry.vertices.size())});
    geometry.vertices.push_back(foot);
    geometry.colour.push_back(own_colours ? geometry.colour[segment.vertex]
                                          : picture::kVerticalColour);
    geometry.label.push_back(geometry.label[segment.vertex]);
    geometry.normals.push_back(geometry.normals[segment.vertex]);
  }
  DropIfNone(geometry.label);
  return geometry;
}

// Points down the vertical lines, so that walls are seen where there are only points.
void AddPointsAlongVerticals(double spacing_m, Geometry& geometry) {
  for (const auto& [a, b] : geometry.lines) {
    const Eigen::Vector3d from = geometry.vertices[a];
    const Eigen::Vector3d way = geometry.vertices[b] - from;
    if (!way.head<2>().isZero(0.0)) continue;
    const auto pieces = static_cast<int>(std::ceil(way.norm() / spacing_m));
    for (int i = 1; i < pieces; ++i) {
      geometry.vertices.push_back(from + way * i / pieces);
      geometry.colour.push_back(geometry.colour[b]);
      if (!geometry.label.empty()) geometry.label.push_back(geometry.label[b]);
    }
  }
}

// What is damaged is left out and said in `damage`.
absl::StatusOr<Geometry> MeshOf(Context& context,
                                const ExportOptions& options,
                                absl::Status& damage) {
  STRATA_ASSIGN_OR_RETURN(const MapInfo info,
                          context.database.maps().Get(context.call, options.map));
  STRATA_ASSIGN_OR_RETURN(const FetchedTiles fetched,
                          FetchTiles(context, options.map, {.level = options.level}));
  damage = fetched.damage;
  const bool own_colours = options.layer == "colour";
  if (own_colours) STRATA_RETURN_IF_ERROR(ExpectColours(options.map, fetched.tiles));
  if (fetched.tiles.empty()) {
    STRATA_RETURN_IF_ERROR(damage);
    return NoSurfaces(options.map);
  }
  const double cell_size_m = info.parameters.mls.cell_size_m;
  Geometry geometry = GeometryOf(fetched.tiles, cell_size_m, options.level, own_colours);
  if (options.format == "mcap") {
    AddPointsAlongVerticals(std::ldexp(cell_size_m, options.level), geometry);
  }
  return geometry;
}

absl::Status ExportFoxglove(Context& context, const ExportOptions& options) {
  absl::Status damage;
  FoxgloveScene scene;
  STRATA_ASSIGN_OR_RETURN(scene.surfaces, MeshOf(context, options, damage));
  STRATA_ASSIGN_OR_RETURN(const api::PoseGraphState graph,
                          context.database.posegraph().Get(context.call, options.map));
  scene.trajectories = TrajectoriesOf(graph.nodes, false);
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, FoxgloveBytes(scene));
  STRATA_RETURN_IF_ERROR(WriteFileBytes(options.out, bytes));
  context.output.Object({{"file", options.out},
                         {"format", options.format},
                         {"points", scene.surfaces.vertices.size()},
                         {"trajectories", scene.trajectories.size()},
                         {"poses", graph.nodes.size()},
                         {"bytes", bytes.size()}});
  return damage;
}

// Every integrated scan's points at their poses.
absl::StatusOr<Geometry> PointsOf(Context& context, const ExportOptions& options) {
  std::vector<ScanInfo> scans;
  api::ScanFilter filter;
  filter.state = ScanState::kIntegrated;
  STRATA_RETURN_IF_ERROR(
      context.database.scans().List(context.call, options.map, filter, [&](const ScanInfo& info) {
        scans.push_back(info);
        return absl::OkStatus();
      }));
  Geometry geometry;
  bool coloured = false;
  for (const ScanInfo& scan : scans) {
    STRATA_RETURN_IF_ERROR(context.database.scans().GetPoints(
        context.call, options.map, scan.header.id, [&](const PointCloud& chunk) {
          for (std::size_t i = 0; i < chunk.size(); ++i) {
            if (!std::isfinite(chunk.points[i].x())) continue;
            geometry.vertices.emplace_back(scan.T_map_scan * chunk.points[i].cast<double>());
            geometry.label.push_back(chunk.label.empty() ? 0 : chunk.label[i]);
            geometry.colour.push_back(chunk.colour.empty() ? picture::kUnknownColour
                                                           : chunk.colour[i]);
            coloured = coloured || !chunk.colour.empty();
          }
          return absl::OkStatus();
        }));
  }
  if (geometry.vertices.empty()) {
    return absl::FailedPreconditionError(
        absl::StrCat("map ",
                     options.map,
                     " has no points: import scans, or wait until they are integrated; a map with "
                     "keep_points off has dropped them, and ply has its surfaces"));
  }
  DropIfNone(geometry.label);
  if (!coloured) geometry.colour.clear();
  return geometry;
}

absl::StatusOr<std::string> BytesOf(const Geometry& geometry, const std::string& format) {
  if (format == "pcd") return PcdBytes(geometry);
  STRATA_ASSIGN_OR_RETURN(const MeshFormat mesh_format, MeshFormatOf(format));
  return MeshBytes(mesh_format, geometry);
}

constexpr std::pair<const char*, const char*> kFormatsOfOptions[] = {
    {"--relative-to", "ply, obj, stl, glb, pcd"},
    {"--layer", "ply, obj, glb, mcap"},
    {"--floor", "nav2"},
    {"--at", "nav2"},
    {"--mode", "nav2"},
    {"--inferred", "nav2"},
    {"--profile", "nav2, geotiff, asc"},
    {"--surface", "geotiff, asc"},
    {"--region", "geotiff, asc, octomap, bt"},
    {"--free", "octomap"},
    {"--level", "ply, obj, stl, glb, mcap, geotiff, asc, octomap, bt"}};

// An option that a format does not listen to would be believed to have been heard.
absl::Status CheckOptions(const ExportOptions& options) {
  for (const auto& [option, formats] : kFormatsOfOptions) {
    if (options.given->count(option) == 0) continue;
    const std::vector<std::string> listening = absl::StrSplit(formats, ", ");
    if (std::find(listening.begin(), listening.end(), options.format) != listening.end()) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        option, " says nothing to --format ", options.format, "; leave it out, or take ", formats));
  }
  return absl::OkStatus();
}

absl::Status Export(Context& context, const ExportOptions& options) {
  STRATA_RETURN_IF_ERROR(CheckOptions(options));
  if (options.format == "nav2") {
    return ExportFloors(context,
                        options.map,
                        options.floor,
                        options.mode == "scale" ? GridMode::kScale : GridMode::kTrinary,
                        options.out);
  }
  if (options.format == "geotiff" || options.format == "asc") {
    HeightOptions heights = options.heights;
    heights.profile = options.floor.profile;
    heights.level = options.level;
    return ExportHeights(context, options.map, heights, options.format, options.out);
  }
  if (options.format == "bt" || options.format == "octomap") {
    const bool with_free = options.format == "bt" || options.free;
    return ExportOctree(context,
                        options.map,
                        {options.level, options.heights.region, options.format, with_free},
                        options.out);
  }
  if (options.format == "mcap") return ExportFoxglove(context, options);
  const bool points = options.format == "pcd";
  absl::Status damage;
  STRATA_ASSIGN_OR_RETURN(Geometry geometry,
                          points ? PointsOf(context, options) : MeshOf(context, options, damage));
  for (Eigen::Vector3d& vertex : geometry.vertices) {
    vertex -= options.origin;
  }
  const bool as_double = (points || options.format == "ply") && NeedsDouble(geometry);
  if (as_double) {
    context.output.Talk(
        "coordinates beyond 8 km are written as doubles, which PCL's point types do not read; "
        "--relative-to X,Y,Z makes them small");
  }
  STRATA_ASSIGN_OR_RETURN(const std::string bytes, BytesOf(geometry, options.format));
  STRATA_RETURN_IF_ERROR(WriteFileBytes(options.out, bytes));
  context.output.Object({{"file", options.out},
                         {"format", options.format},
                         {"vertices", geometry.vertices.size()},
                         {"triangles", geometry.triangles.size()},
                         {"lines", geometry.lines.size()},
                         {"coordinates",
                          options.format == "obj" ? "text"
                          : as_double             ? "double"
                                                  : "float"},
                         {"relative_to", ToJson(options.origin)},
                         {"bytes", bytes.size()}});
  return damage;
}

}  // namespace

void AddMapExport(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* app = commands.Verb(
      noun,
      "export",
      "Write a map for other programs: its surfaces as a mesh (ply, obj, stl, glb), the points of "
      "its scans (pcd), its floors as grids (nav2), one height a cell (geotiff, asc), free and "
      "occupied space (octomap), or surfaces and trajectories for Foxglove (mcap)",
      "strata map export campus --format ply --out campus.ply\n"
      "  strata map export campus --format octomap --free --out campus.bt\n"
      "  strata map export campus --format mcap --out campus.mcap",
      [options](Context& context) { return Export(context, *options); });
  options->given = app;
  AddMapName(app, options->map);
  app->add_option(
         "--format",
         options->format,
         "ply: triangles and edges, colour by traversability and the class as label where there "
         "are classes, binary; obj: the same as text, without label; stl: triangles alone; glb: "
         "triangles and colour, for viewers; pcd: all points, binary x y z and, where there are, "
         "rgb "
         "and label; nav2: a picture (pgm) and a yaml file for map_server, of one floor or a pair "
         "each of all; geotiff: heights and their standard deviation as bands, on earth where the "
         "map has an origin; asc: the same as ESRI ASCII grids, FILE.asc and FILE-sigma.asc, with "
         ".prj; octomap: an octree of OctoMap (.bt) of what the scans' rays hit, with --free of "
         "what "
         "they went through, too; bt: the same with free space; mcap: "
         "/surfaces as points (foxglove.PointCloud), /trajectories/NAME and /tf with the scans' "
         "poses and times (PosesInFrame, FrameTransform), as JSON")
      ->check(CLI::IsMember(
          {"ply", "obj", "stl", "glb", "pcd", "nav2", "geotiff", "asc", "octomap", "bt", "mcap"}))
      ->required();
  app->add_option("--out", options->out, "The file to write")->type_name("FILE")->required();
  AddNumbers(
      app,
      "--relative-to",
      "X,Y,Z",
      3,
      3,
      [options](const std::vector<double>& n) {
        options->origin = {n[0], n[1], n[2]};
      },
      "Coordinates relative to this place, for maps far from their origin [m]");
  app->add_option("--layer", options->layer, "What the colours of a mesh say")
      ->check(CLI::IsMember({"traversability", "colour"}))
      ->capture_default_str();
  AddFloorOptions(app, options->floor, true);
  AddInferred(app, options->floor.inferred);
  app->add_option("--mode",
                  options->mode,
                  "nav2: free, occupied and unknown alone, or with costs where ground was seen "
                  "on which the robot cannot be")
      ->check(CLI::IsMember({"trinary", "scale"}))
      ->capture_default_str();
  app->add_option(
         "--surface",
         options->heights.surface,
         "geotiff, asc: the highest surface of each cell; all of them fused (kalman), "
         "overhangs too; or the lowest that the robot of --profile can drive on, so that "
         "underpasses stay open (ground), with a band for what each cell is: 1 traversable, "
         "2 not, 3 vertical, 4 traversable below or above something")
      ->check(CLI::IsMember({"highest", "kalman", "ground"}))
      ->capture_default_str();
  AddRegion(app, options->heights.region);
  app->add_flag("--free",
                options->free,
                "octomap: free space, too: what rays went through and did not end in");
  app->add_option(
         "--level", options->level, "Level of detail of a mesh, heights or octree, 0 = finest")
      ->check(CLI::Range(0, kMaxLevel))
      ->capture_default_str();
}

}  // namespace strata::cli
