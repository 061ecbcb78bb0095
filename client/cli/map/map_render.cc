// strata map render
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"

#include "client/cli/map/floor_files.h"
#include "client/cli/map/map_files.h"
#include "client/cli/map/tile_source.h"
#include "client/cli/objects/fetched_entities.h"
#include "client/cli/objects/fetched_inferred.h"
#include "client/cli/picture/map_picture.h"
#include "client/cli/posegraph/graph_overlay.h"
#include "client/cli/terminal/angles.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"
#include "client/formats/file_bytes.h"
#include "client/formats/path_file.h"
#include "core/api/planning.h"
#include "core/common/status.h"
#include "core/world/map_class.h"

namespace strata::cli {
namespace {

struct RenderOptions {
  std::string map;
  std::string out;
  std::vector<std::string> path_files;
  std::string view = "top";
  std::string layer = "traversability";
  double azimuth_rad = -1.0;
  double elevation_rad = 0.6;
  std::optional<int> level;
  FloorOptions floor;
  bool trajectories = false;
  bool constraints = false;
  bool objects = false;
  bool inferred = false;
  picture::PictureOptions picture;
};

// The coarsest level whose cells are no larger than a pixel.
std::int32_t LevelFor(const MapStats& stats,
                      double cell_size_m,
                      const picture::PictureOptions& options) {
  const Eigen::Vector3d size = stats.box_max - stats.box_min;
  const double metres_per_pixel = std::max(size.x() / options.width, size.y() / options.height);
  const double ratio = metres_per_pixel / cell_size_m;
  return ratio < 2.0 ? 0 : std::min(static_cast<int>(std::log2(ratio)), kMaxLevel);
}

absl::StatusOr<picture::Overlay> OverlayOf(Context& context, const RenderOptions& options) {
  picture::Overlay overlay;
  if (options.objects) {
    STRATA_ASSIGN_OR_RETURN(const FetchedEntities entities,
                            FetchEntities(context, options.map, {}, ""));
    AddEntities(entities, overlay);
  }
  if (options.inferred) {
    STRATA_ASSIGN_OR_RETURN(const FetchedInferred inferred,
                            FetchInferred(context, options.map, {}, ""));
    AddInferred(inferred, overlay);
  }
  if (!options.trajectories && !options.constraints) return overlay;
  STRATA_ASSIGN_OR_RETURN(const api::PoseGraphState state,
                          context.database.posegraph().Get(context.call, options.map));
  if (options.constraints) AddConstraints(state, overlay);
  if (options.trajectories) AddTrajectories(state, overlay);
  return overlay;
}

// Every class that surfaces have, by the map's table.
absl::StatusOr<picture::ClassStyles> StylesOf(Context& context,
                                              const std::string& map,
                                              const std::vector<SurfaceTile>& tiles) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> classes,
                          context.database.maps().ListClasses(context.call, map));
  picture::ClassStyles styles;
  for (const SurfaceTile& tile : tiles) {
    for (const Surface& surface : tile.surfaces) {
      const std::uint8_t id = surface.class_id;
      if (id == 0 || styles.contains(id)) continue;
      const MapClass map_class = ClassOf(classes, id);
      styles[id] = {map_class.name, map_class.colour};
    }
  }
  return styles;
}

Json LegendJson(const picture::ClassStyles& styles) {
  Json legend = Json::array();
  for (const auto& [id, style] : styles)
    legend.push_back(ToJson(MapClass{id, style.name, style.colour}));
  return legend;
}

absl::Status Render(Context& context, RenderOptions options) {
  if (options.view == "oblique") {
    options.picture.azimuth_rad = options.azimuth_rad;
    options.picture.elevation_rad = options.elevation_rad;
  }
  std::vector<picture::Path> paths;
  for (const std::string& file : options.path_files) {
    STRATA_ASSIGN_OR_RETURN(picture::Path path, ReadPath(file));
    paths.push_back(std::move(path));
  }
  STRATA_ASSIGN_OR_RETURN(const MapInfo info,
                          context.database.maps().Get(context.call, options.map));
  STRATA_ASSIGN_OR_RETURN(const MapStats stats,
                          context.database.maps().Stats(context.call, options.map));
  const double cell = info.parameters.mls.cell_size_m;
  const bool whole = !options.floor.floor.has_value() && !options.floor.at.has_value();
  if (!whole && options.level.value_or(0) != 0) {
    return absl::InvalidArgumentError("floors are of level 0; leave --level out");
  }
  if (whole && options.floor.profile != api::kDefaultProfile) {
    return absl::InvalidArgumentError(
        "--profile goes with --floor or --at; a whole map is coloured for its default profile");
  }
  const std::int32_t level =
      whole ? options.level.value_or(LevelFor(stats, cell, options.picture)) : 0;
  STRATA_ASSIGN_OR_RETURN(FetchedTiles fetched, FetchTiles(context, options.map, {.level = level}));
  STRATA_RETURN_IF_ERROR(KeepFloor(context, options.map, options.floor, fetched.tiles));
  if (options.layer == "class") {
    STRATA_ASSIGN_OR_RETURN(options.picture.classes, StylesOf(context, options.map, fetched.tiles));
  }
  if (options.layer == "colour") {
    STRATA_RETURN_IF_ERROR(ExpectColours(options.map, fetched.tiles));
    options.picture.own_colours = true;
  }
  STRATA_ASSIGN_OR_RETURN(const picture::Overlay overlay, OverlayOf(context, options));
  const picture::Picture picture = picture::DrawMap(
      fetched.tiles, cell * static_cast<double>(1 << level), paths, options.picture, overlay);
  STRATA_ASSIGN_OR_RETURN(const std::string png, picture::PngBytes(picture.image));
  STRATA_RETURN_IF_ERROR(WriteFileBytes(options.out, png));
  const picture::Camera& camera = picture.camera;
  context.output.Object(
      {{"file", options.out},
       {"view", options.view},
       {"layer", options.layer},
       {"classes", LegendJson(options.picture.classes.value_or(picture::ClassStyles()))},
       {"width", picture.image.width},
       {"height", picture.image.height},
       {"legend_height", picture::kLegendPixels},
       {"metres_per_pixel", camera.metres_per_pixel},
       {"centre", ToJson(camera.centre)},
       {"right", ToJson(camera.right)},
       {"up", ToJson(camera.up)},
       {"level", level},
       {"tiles", fetched.tiles.size()},
       {"paths", paths.size()},
       {"lines", overlay.strokes.size()}});
  return fetched.damage;
}

void SetSize(const std::string& text, picture::PictureOptions& options) {
  const std::vector<std::string> parts = absl::StrSplit(text, 'x');
  constexpr int kLeast = 200;
  constexpr int kMost = 8000;
  int width = 0;
  int height = 0;
  if (parts.size() != 2 || !absl::SimpleAtoi(parts[0], &width) ||
      !absl::SimpleAtoi(parts[1], &height) || std::min(width, height) < kLeast ||
      std::max(width, height) > kMost) {
    throw CLI::ValidationError("--size",
                               "expected WIDTHxHEIGHT of 200 to 8000 pixels, got " + text);
  }
  options.width = width;
  options.height = height;
}

// For CLI11: empty, or what is wrong. Names without an ending of pictures (/dev/stdout) will do.
std::string IsNoOtherPicture(const std::string& file) {
  const std::string ending =
      absl::AsciiStrToLower(std::filesystem::path(file).extension().string());
  constexpr const char* kOthers[] = {
      ".jpg", ".jpeg", ".gif", ".bmp", ".tif", ".tiff", ".webp", ".svg", ".pdf"};
  const bool other = std::find(std::begin(kOthers), std::end(kOthers), ending) != std::end(kOthers);
  return other ? "pictures are written as PNG; expected FILE.png, got " + file : "";
}

void AddViewOptions(CLI::App* render, const std::shared_ptr<RenderOptions>& options) {
  const auto in_degrees = [](double angle_rad) {
    return absl::StrFormat("%.0f", angle_rad * 180.0 / std::numbers::pi);
  };
  render->add_option("--view", options->view, "top, or oblique from above and aside")
      ->check(CLI::IsMember({"top", "oblique"}))
      ->capture_default_str();
  TakesAngle(render->add_option(
                 "--azimuth", options->azimuth_rad, "Where an oblique view looks from [degrees]"))
      ->default_str(in_degrees(options->azimuth_rad));
  TakesAngle(render->add_option("--elevation",
                                options->elevation_rad,
                                "Its angle above the ground [degrees], 3 to 90"))
      ->check(CLI::Range(0.05, 1.5708))
      ->default_str(in_degrees(options->elevation_rad));
  render
      ->add_option_function<std::string>(
          "--size",
          [options](const std::string& text) { SetSize(text, options->picture); },
          "Size of the picture in pixels")
      ->type_name("WIDTHxHEIGHT")
      ->default_str("1600x1100");
  render->add_option("--level", options->level, "Level of detail; default: as fine as the pixels")
      ->check(CLI::Range(0, kMaxLevel));
}

}  // namespace

void AddMapRender(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<RenderOptions>();
  CLI::App* render = commands.Verb(
      noun,
      "render",
      "Draw a map: traversable yellow, horizontal but not traversable red, vertical blue; or "
      "every class in its colour; or all in the colours of the points",
      "strata map render campus campus.png --view oblique --path route.ply",
      [options](Context& context) { return Render(context, *options); });
  AddMapName(render, options->map);
  render
      ->add_option("OUT",
                   options->out,
                   "The PNG file to write: RGB, the legend, a scale bar and the map's axes on it")
      ->type_name("FILE.png")
      ->check(IsNoOtherPicture)
      ->required();
  AddNumbers(
      render,
      "--slice",
      "Z0,Z1",
      2,
      2,
      [options](const std::vector<double>& n) {
        if (n[0] >= n[1]) {
          throw CLI::ValidationError("--slice", "expected Z0 < Z1");
        }
        options->picture.slice_m = {n[0], n[1]};
      },
      "Only what lies between these heights [m]");
  render
      ->add_option(
          "--path", options->path_files, "PLY file of a path to draw; may be given several times")
      ->type_name("FILE.ply")
      ->allow_extra_args(false);
  render->add_flag(
      "--trajectories", options->trajectories, "The way of each trajectory through its scans");
  render->add_flag("--constraints",
                   options->constraints,
                   "What holds the scans together, coloured by how well the poses keep it");
  render->add_flag("--objects",
                   options->objects,
                   "The boxes of the things that objects find found, in the colours of classes");
  render->add_flag(
      "--inferred", options->inferred, "What objects complete inferred of them, hatched");
  render->add_option("--layer", options->layer, "What the colours of surfaces say")
      ->check(CLI::IsMember({"traversability", "class", "colour"}))
      ->capture_default_str();
  AddFloorOptions(render, options->floor, true);
  AddViewOptions(render, options);
}

}  // namespace strata::cli
