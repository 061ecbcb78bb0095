// strata map diff
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "client/cli/map/map_files.h"
#include "client/cli/picture/map_picture.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/names.h"
#include "client/formats/file_bytes.h"
#include "client/formats/geometry_writer.h"
#include "core/codec/surface_tile_codec.h"
#include "core/common/status.h"
#include "core/mls/difference.h"

namespace strata::cli {
namespace {

using Kind = SurfaceChange::Kind;

// MAP or MAP@EPOCH.
struct State {
  std::string text;
  std::string map;
  std::uint64_t epoch = 0;  // 0: the current one
};

struct DiffOptions {
  State earlier, later;
  std::string out;
};

State ParseState(const std::string& text) {
  State state = {text, text, 0};
  const std::size_t at = text.find('@');
  if (at == std::string::npos) return state;
  state.map = text.substr(0, at);
  if (!absl::SimpleAtoi(text.substr(at + 1), &state.epoch) || state.epoch == 0) {
    throw CLI::ValidationError(text, "expected MAP or MAP@EPOCH");
  }
  return state;
}

// Tiles as served, by key.
using Tiles = std::map<TileKey, std::string>;

// The tiles of `state` that one who holds `held` lacks; `told` gets the keys of all that differ.
absl::StatusOr<Tiles> Fetch(Context& context,
                            const State& state,
                            const std::vector<api::HeldTile>& held,
                            std::set<TileKey>& told) {
  Tiles tiles;
  api::TileArea area;
  area.epoch = state.epoch;
  const auto take = [&](const api::TileUpdate& update) -> absl::Status {
    told.insert(update.tile.key);
    if (update.kind == api::TileUpdate::Kind::kDamaged) {
      return absl::DataLossError(absl::StrCat("tile ",
                                              update.tile.key.ToString(),
                                              " is damaged; map rebuild ",
                                              state.map,
                                              " mends it"));
    }
    if (update.kind != api::TileUpdate::Kind::kGone) tiles[update.tile.key] = update.tile.bytes;
    return absl::OkStatus();
  };
  STRATA_RETURN_IF_ERROR(context.database.tiles().Fetch(context.call, state.map, area, held, take));
  return tiles;
}

struct Sides {
  Tiles earlier, later;
};

absl::StatusOr<Sides> FetchAll(Context& context, const DiffOptions& options) {
  Sides sides;
  std::set<TileKey> told;
  STRATA_ASSIGN_OR_RETURN(sides.earlier, Fetch(context, options.earlier, {}, told));
  STRATA_ASSIGN_OR_RETURN(sides.later, Fetch(context, options.later, {}, told));
  return sides;
}

// Two states of one map: tiles that are in both as they are now are not fetched.
absl::StatusOr<Sides> FetchDiffering(Context& context, const DiffOptions& options) {
  const State now = {options.later.map, options.later.map, 0};
  STRATA_ASSIGN_OR_RETURN(const std::vector<api::TileInfo> listed,
                          context.database.tiles().List(context.call, now.map, {}));
  std::vector<api::HeldTile> held;
  held.reserve(listed.size());
  for (const api::TileInfo& tile : listed) held.push_back({tile.key, tile.version});
  std::set<TileKey> earlier_told;
  std::set<TileKey> later_told;
  Sides sides;
  STRATA_ASSIGN_OR_RETURN(sides.earlier, Fetch(context, options.earlier, held, earlier_told));
  STRATA_ASSIGN_OR_RETURN(sides.later, Fetch(context, options.later, held, later_told));
  std::set<TileKey> told = earlier_told;
  told.insert(later_told.begin(), later_told.end());
  std::erase_if(held, [&told](const api::HeldTile& tile) { return told.contains(tile.key); });
  STRATA_ASSIGN_OR_RETURN(const Tiles rest, Fetch(context, now, held, told));
  for (const auto& [key, bytes] : rest) {
    if (!earlier_told.contains(key)) sides.earlier[key] = bytes;
    if (!later_told.contains(key)) sides.later[key] = bytes;
  }
  return sides;
}

// How much is different, in a tile or in all.
struct Difference {
  std::uint64_t added = 0, removed = 0, moved = 0, same = 0;
  double squared_rises = 0.0;
  double largest_rise_m = 0.0;  // with its sign

  void Count(const SurfaceChange& change) {
    added += change.kind == Kind::kAdded ? 1 : 0;
    removed += change.kind == Kind::kRemoved ? 1 : 0;
    same += change.kind == Kind::kSame ? 1 : 0;
    if (change.kind != Kind::kMoved) return;
    ++moved;
    const double rise_m = change.rise_m;
    squared_rises += rise_m * rise_m;
    if (std::abs(rise_m) > std::abs(largest_rise_m)) largest_rise_m = rise_m;
  }
  void Add(const Difference& other) {
    added += other.added;
    removed += other.removed;
    moved += other.moved;
    same += other.same;
    squared_rises += other.squared_rises;
    if (std::abs(other.largest_rise_m) > std::abs(largest_rise_m)) {
      largest_rise_m = other.largest_rise_m;
    }
  }
  std::uint64_t changed() const { return added + removed + moved; }
  double RiseRms() const {
    return moved == 0 ? 0.0 : std::sqrt(squared_rises / static_cast<double>(moved));
  }
  Json ToJson(double cell_size_m) const {
    const double area_m2 = cell_size_m * cell_size_m;
    const auto area = [area_m2](std::uint64_t count) {
      return static_cast<double>(count) * area_m2;
    };
    return {{"added", added},
            {"removed", removed},
            {"moved", moved},
            {"unchanged", same},
            {"added_m2", area(added)},
            {"removed_m2", area(removed)},
            {"moved_m2", area(moved)},
            {"rise_rms_m", RiseRms()},
            {"rise_largest_m", largest_rise_m}};
  }
};

struct ComparedTile {
  TileKey key;
  std::vector<SurfaceChange> changes;
  Difference difference;
};

absl::StatusOr<SurfaceTile> Decoded(const Tiles& tiles, const TileKey& key) {
  const auto it = tiles.find(key);
  if (it != tiles.end()) return DecodeSurfaceTile(it->second);
  SurfaceTile tile;
  tile.key = key;
  return tile;
}

// `keep`: the surfaces too, of all tiles; else the numbers of those that are different.
absl::StatusOr<std::vector<ComparedTile>> Compare(const Sides& sides,
                                                  double gap_size_m,
                                                  bool keep) {
  std::set<TileKey> keys;
  for (const auto& [key, bytes] : sides.earlier) keys.insert(key);
  for (const auto& [key, bytes] : sides.later) keys.insert(key);
  std::vector<ComparedTile> compared;
  for (const TileKey& key : keys) {
    STRATA_ASSIGN_OR_RETURN(const SurfaceTile earlier, Decoded(sides.earlier, key));
    STRATA_ASSIGN_OR_RETURN(const SurfaceTile later, Decoded(sides.later, key));
    ComparedTile tile = {key, CompareTiles(earlier, later, gap_size_m), {}};
    for (const SurfaceChange& change : tile.changes) tile.difference.Count(change);
    if (!keep) tile.changes.clear();
    compared.push_back(std::move(tile));
  }
  return compared;
}

constexpr Colour kAddedColour = {46, 160, 67};
constexpr Colour kRemovedColour = {207, 48, 43};
// Far down, a little down, a little up, far up.
constexpr Colour kSunkColour = {24, 56, 190};
constexpr Colour kLittleSunkColour = {140, 190, 255};
constexpr Colour kLittleRisenColour = {196, 120, 20};
constexpr Colour kRisenColour = {255, 222, 50};
// Moves are drawn in so many steps of height, half of them down.
constexpr int kRiseSteps = 6;
constexpr std::uint8_t kUnchangedStyle = 1, kAddedStyle = 2, kRemovedStyle = 3, kFirstRiseStyle = 4;

// In [0, kRiseSteps): which step of ±`largest_m` a rise falls into, or is beyond.
int RiseStep(double rise_m, double largest_m) {
  const double share = 0.5 + 0.5 * rise_m / largest_m;
  return std::clamp(static_cast<int>(share * kRiseSteps), 0, kRiseSteps - 1);
}

Colour RiseColour(int step) {
  constexpr int kHalf = kRiseSteps / 2;
  const double share = static_cast<double>(step % kHalf) / (kHalf - 1);
  return step < kHalf ? picture::Blend(kSunkColour, kLittleSunkColour, share)
                      : picture::Blend(kLittleRisenColour, kRisenColour, share);
}

picture::ClassStyles Styles(double largest_m) {
  picture::ClassStyles styles = {{kUnchangedStyle, {"unchanged", picture::kUnknownColour}},
                                 {kAddedStyle, {"added", kAddedColour}},
                                 {kRemovedStyle, {"removed", kRemovedColour}}};
  for (int step = 0; step < kRiseSteps; ++step) {
    const double middle_m = largest_m * ((2.0 * step + 1.0) / kRiseSteps - 1.0);
    styles[static_cast<std::uint8_t>(kFirstRiseStyle + step)] = {
        absl::StrFormat("%s %.2f m", middle_m < 0.0 ? "sunk" : "risen", std::abs(middle_m)),
        RiseColour(step)};
  }
  return styles;
}

std::uint8_t StyleOf(const SurfaceChange& change, double largest_m) {
  switch (change.kind) {
    case Kind::kSame:
      return kUnchangedStyle;
    case Kind::kAdded:
      return kAddedStyle;
    case Kind::kRemoved:
      return kRemovedStyle;
    case Kind::kMoved:
      break;
  }
  return static_cast<std::uint8_t>(kFirstRiseStyle + RiseStep(change.rise_m, largest_m));
}

absl::StatusOr<std::string> PictureOf(const std::vector<ComparedTile>& compared,
                                      double cell_size_m,
                                      double largest_m) {
  std::vector<SurfaceTile> tiles;
  for (const ComparedTile& tile : compared) {
    SurfaceTile& drawn = tiles.emplace_back();
    drawn.key = tile.key;
    for (const SurfaceChange& change : tile.changes) {
      drawn.surfaces.push_back(change.surface);
      drawn.surfaces.back().class_id = StyleOf(change, largest_m);
    }
  }
  picture::PictureOptions options;
  options.classes = Styles(largest_m);
  return picture::PngBytes(picture::DrawMap(tiles, cell_size_m, {}, options).image);
}

// A vertex for each surface that is different.
absl::StatusOr<std::string> PlyOf(const std::vector<ComparedTile>& compared,
                                  double cell_size_m,
                                  double largest_m) {
  const picture::ClassStyles styles = Styles(largest_m);
  Geometry geometry;
  for (const ComparedTile& tile : compared) {
    for (const SurfaceChange& change : tile.changes) {
      if (change.kind == Kind::kSame) continue;
      const CellIndex cell = CellOf(tile.key, change.surface.cell);
      geometry.vertices.emplace_back(
          (cell.x + 0.5) * cell_size_m, (cell.y + 0.5) * cell_size_m, change.surface.z_m);
      geometry.colour.push_back(styles.at(StyleOf(change, largest_m)).colour);
      geometry.intensity.push_back(change.rise_m);
    }
  }
  return PlyBytes(geometry);
}

absl::Status Write(Context& context,
                   const std::string& out,
                   const std::vector<ComparedTile>& compared,
                   double cell_size_m,
                   const Difference& total) {
  // Few moves are much larger than the others: twice the root mean square spreads the colours.
  const double largest_m = std::clamp(
      2.0 * total.RiseRms(), kLeastRiseM, std::max(kLeastRiseM, std::abs(total.largest_rise_m)));
  STRATA_ASSIGN_OR_RETURN(const std::string bytes,
                          absl::EndsWith(out, ".ply")
                              ? PlyOf(compared, cell_size_m, largest_m)
                              : PictureOf(compared, cell_size_m, largest_m));
  STRATA_RETURN_IF_ERROR(WriteFileBytes(out, bytes));
  context.output.Talk("wrote " + out);
  return absl::OkStatus();
}

absl::StatusOr<MlsParameters> CommonParameters(Context& context, const DiffOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const MapInfo earlier,
                          context.database.maps().Get(context.call, options.earlier.map));
  STRATA_ASSIGN_OR_RETURN(const MapInfo later,
                          context.database.maps().Get(context.call, options.later.map));
  const MlsParameters& a = earlier.parameters.mls;
  const MlsParameters& b = later.parameters.mls;
  if (a.cell_size_m == b.cell_size_m && a.gap_size_m == b.gap_size_m) return b;
  return absl::FailedPreconditionError(
      absl::StrCat("maps of different cells or gaps cannot be compared: ",
                   earlier.name,
                   " has ",
                   a.cell_size_m,
                   " m and ",
                   a.gap_size_m,
                   " m, ",
                   later.name,
                   " ",
                   b.cell_size_m,
                   " m and ",
                   b.gap_size_m,
                   " m; import the scans of one into a map made like the other"));
}

// The tiles with most differences first.
Json RowsOf(std::vector<ComparedTile> compared, double cell_size_m) {
  std::erase_if(compared, [](const ComparedTile& t) { return t.difference.changed() == 0; });
  std::sort(compared.begin(), compared.end(), [](const ComparedTile& a, const ComparedTile& b) {
    return std::pair(b.difference.changed(), a.key) < std::pair(a.difference.changed(), b.key);
  });
  Json rows = Json::array();
  for (const ComparedTile& tile : compared) {
    Json row = {{"key", tile.key.ToString()}};
    row.update(tile.difference.ToJson(cell_size_m));
    rows.push_back(row);
  }
  return rows;
}

absl::Status Diff(Context& context, const DiffOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const MlsParameters parameters, CommonParameters(context, options));
  const double cell_size_m = parameters.cell_size_m;
  // A picture shows what is unchanged around.
  const bool all = options.earlier.map != options.later.map || absl::EndsWith(options.out, ".png");
  STRATA_ASSIGN_OR_RETURN(const Sides sides,
                          all ? FetchAll(context, options) : FetchDiffering(context, options));
  STRATA_ASSIGN_OR_RETURN(std::vector<ComparedTile> compared,
                          Compare(sides, parameters.gap_size_m, !options.out.empty()));
  Difference total;
  for (const ComparedTile& tile : compared) total.Add(tile.difference);
  if (!options.out.empty()) {
    STRATA_RETURN_IF_ERROR(Write(context, options.out, compared, cell_size_m, total));
  }
  Json json = {{"earlier", options.earlier.text}, {"later", options.later.text}};
  json.update(total.ToJson(cell_size_m));
  json["tiles_compared"] = compared.size();
  Json rows = RowsOf(std::move(compared), cell_size_m);
  json["tiles_different"] = rows.size();
  if (context.output.json()) {
    json["tiles"] = rows;
    context.output.Object(json);
    return absl::OkStatus();
  }
  context.output.Object(json);
  constexpr std::size_t kWorst = 10;
  if (rows.size() > kWorst && context.output.text()) rows.erase(rows.begin() + kWorst, rows.end());
  if (rows.empty() && context.output.text()) return absl::OkStatus();
  context.output.Text("");
  context.output.List(rows,
                      {{"key", "TILE"},
                       {"added", "ADDED"},
                       {"removed", "REMOVED"},
                       {"moved", "MOVED"},
                       {"rise_rms_m", "RMS [m]"},
                       {"rise_largest_m", "LARGEST [m]"}});
  return absl::OkStatus();
}

}  // namespace

void AddMapDiff(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<DiffOptions>();
  CLI::App* diff = commands.Verb(
      noun,
      "diff",
      "What is different between two maps or two epochs of a map: surfaces that came, went and "
      "moved in height",
      "strata map diff campus@3 campus --out diff.png",
      [options](Context& context) { return Diff(context, *options); });
  const auto add = [&](const char* name, State& state, const char* description) {
    TakesName(
        diff->add_option_function<std::string>(
                name, [&state](const std::string& text) { state = ParseState(text); }, description)
            ->type_name("MAP[@EPOCH]")
            ->required(),
        kMapNames);
  };
  add("EARLIER", options->earlier, "A map, or one of its epochs; see map history");
  add("LATER", options->later, "What it is compared with");
  diff->add_option("--out",
                   options->out,
                   "Also a picture (.png: added green, removed red, sunk blue to risen yellow) or "
                   "the surfaces that differ (.ply: the same colours, the rise as intensity)")
      ->type_name("FILE.png|FILE.ply")
      ->check([](const std::string& text) {
        return absl::EndsWith(text, ".png") || absl::EndsWith(text, ".ply")
                   ? std::string()
                   : "expected FILE.png or FILE.ply, got " + text;
      });
}

}  // namespace strata::cli
