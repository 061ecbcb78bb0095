// strata map watch
#include <cstdint>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "client/cli/map/map_files.h"
#include "client/cli/terminal/arguments.h"
#include "client/cli/terminal/command.h"
#include "client/cli/terminal/json.h"
#include "client/cli/terminal/world_json.h"

namespace strata::cli {
namespace {

struct MapWatchOptions {
  std::string map;
  api::WatchOptions watch;
  bool no_tiles = false;
};

std::string TextOf(const api::ScanChange& scan) {
  if (scan.gone) return absl::StrCat("scan ", scan.id.ToString(), " deleted");
  const Eigen::Vector3d t = scan.T_map_scan.translation();
  return absl::StrFormat("scan %s %s at %.3f, %.3f, %.3f",
                         scan.id.ToString(),
                         ToString(scan.state),
                         t.x(),
                         t.y(),
                         t.z());
}

std::string TextOf(const api::TileChangeNotice& tile) {
  return absl::StrCat(
      "tile ", tile.key.ToString(), tile.gone ? " gone" : absl::StrCat(" version ", tile.version));
}

void Print(const api::MapUpdate& update, Output& output) {
  if (!output.text()) {
    output.JsonLine(ToJson(update));
    return;
  }
  const bool reason = !update.epoch_reason.empty();
  output.Text(absl::StrCat("commit ",
                           update.commit_sequence,
                           " epoch ",
                           update.epoch,
                           reason ? " " + update.epoch_reason : "",
                           update.whole ? ", everything there is:" : "",
                           update.inferred ? ", what is inferred may be another" : ""));
  for (const api::ScanChange& scan : update.scans) output.Text("  " + TextOf(scan));
  for (const api::TileChangeNotice& tile : update.tiles) output.Text("  " + TextOf(tile));
}

absl::Status Watch(Context& context, const MapWatchOptions& options) {
  api::WatchOptions watch = options.watch;
  watch.tiles = !options.no_tiles;
  std::uint64_t since = watch.since;
  const absl::Status ended = context.database.maps().Watch(
      context.call, options.map, watch, [&](const api::MapUpdate& update) {
        Print(update, context.output);
        since = update.commit_sequence;
        return absl::OkStatus();
      });
  if (ended.ok()) return ended;
  context.output.Talk(absl::StrCat("--since ", since, " goes on from here"));
  // A watch without an end is ended by its user.
  return context.call.stop.requested() && !watch.once ? absl::OkStatus() : ended;
}

}  // namespace

void AddMapWatch(Commands& commands, CLI::App* noun) {
  auto options = std::make_shared<MapWatchOptions>();
  CLI::App* watch = commands.Verb(
      noun,
      "watch",
      "Follow a map: scan states, corrected poses, epochs and tiles as they change, until Ctrl-C",
      "strata map watch campus --trajectory segway --since 812 --output json",
      [options](Context& context) { return Watch(context, *options); });
  AddMapName(watch, options->map);
  watch
      ->add_option("--since",
                   options->watch.since,
                   "Only what changed after this commit; 0: first everything there is")
      ->capture_default_str();
  watch->add_option("--trajectory", options->watch.trajectory, "Only scans of this trajectory");
  watch->add_flag("--no-tiles", options->no_tiles, "Only scans and epochs");
  watch->add_flag("--once", options->watch.once, "End when there is nothing newer");
}

}  // namespace strata::cli
