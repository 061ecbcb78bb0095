// strata tile list|get
#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"
#include "client/formats/file_bytes.h"
#include "core/codec/surface_tile_codec.h"
#include "core/common/status.h"

namespace strata::cli {
namespace {

struct TileOptions {
  std::string map;
  TileKey key;
  api::TileArea area;
  std::string out;
  bool surfaces = false;
};

absl::Status List(Context& context, const TileOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<api::TileInfo> tiles,
                          context.database.tiles().List(context.call, options.map, options.area));
  Json rows = Json::array();
  for (const api::TileInfo& tile : tiles) {
    rows.push_back(ToJson(tile));
  }
  context.output.List(
      rows, {{"key", "KEY"}, {"version", "VERSION"}, {"patches", "PATCHES"}, {"bytes", "BYTES"}});
  return absl::OkStatus();
}

Json Surfaces(const SurfaceTile& tile, double cell_size_m) {
  Json surfaces = Json::array();
  const double size = cell_size_m * static_cast<double>(std::int64_t{1} << tile.key.level);
  for (const Surface& surface : tile.surfaces) {
    const CellIndex cell = CellOf(tile.key, surface.cell);
    Json json = {{"x", (cell.x + 0.5) * size}, {"y", (cell.y + 0.5) * size}};
    json.update(ToJson(surface));
    surfaces.push_back(json);
  }
  return surfaces;
}

absl::Status Get(Context& context, const TileOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const api::EncodedTile encoded,
                          context.database.tiles().Get(context.call, options.map, options.key));
  STRATA_ASSIGN_OR_RETURN(const SurfaceTile tile, DecodeSurfaceTile(encoded.bytes));
  if (!options.out.empty()) {
    STRATA_RETURN_IF_ERROR(WriteFileBytes(options.out, encoded.bytes));
    context.output.Talk("wrote " + options.out);
  }
  Json json = {{"key", encoded.key.ToString()},
               {"version", encoded.version},
               {"epoch", encoded.epoch},
               {"bytes", encoded.bytes.size()},
               {"patches", tile.surfaces.size()}};
  if (options.surfaces) {
    STRATA_ASSIGN_OR_RETURN(const MapInfo info,
                            context.database.maps().Get(context.call, options.map));
    json["surfaces"] = Surfaces(tile, info.parameters.mls.cell_size_m);
  }
  context.output.Object(json);
  return absl::OkStatus();
}

}  // namespace

void AddTileCommands(Commands& commands) {
  auto options = std::make_shared<TileOptions>();
  CLI::App* noun = commands.Noun("tile",
                                 "Squares of 256 x 256 cells, at several levels of detail",
                                 "strata tile list campus --level 2");
  CLI::App* list = commands.Verb(noun,
                                 "list",
                                 "Tiles of one level of detail",
                                 "strata tile list campus --level 2",
                                 [options](Context& context) { return List(context, *options); });
  AddMapName(list, options->map);
  list->add_option("--level", options->area.level, "Level of detail, 0 = finest")
      ->capture_default_str();
  list->add_option("--epoch",
                   options->area.epoch,
                   "As the poses of an earlier epoch make them; see map history")
      ->check(CLI::PositiveNumber);
  AddNumbers(
      list,
      "--area",
      "X0,Y0,X1,Y1",
      4,
      4,
      [options](const std::vector<double>& n) {
        if (n[0] > n[2] || n[1] > n[3]) {
          throw CLI::ValidationError("--area", "expected X0 <= X1 and Y0 <= Y1");
        }
        const auto index = [&](int i) {
          constexpr double kLimit = 1LL << 31;
          return static_cast<std::int64_t>(
              std::clamp(n[static_cast<std::size_t>(i)], -kLimit, kLimit));
        };
        options->area.x_min = index(0);
        options->area.y_min = index(1);
        options->area.x_max = index(2);
        options->area.y_max = index(3);
      },
      "Only tiles X0 <= x < X1, Y0 <= y < Y1");
  CLI::App* get = commands.Verb(noun,
                                "get",
                                "One tile",
                                "strata tile get campus 0/-1/2 --out tile.bin",
                                [options](Context& context) { return Get(context, *options); });
  AddMapName(get, options->map);
  AddTileKey(get, options->key);
  get->add_option("--out",
                  options->out,
                  "Write the tile's bytes as served (core/codec/FORMAT.md: surface tile)");
  get->add_flag("--surfaces", options->surfaces, "Print every surface too");
}

}  // namespace strata::cli
