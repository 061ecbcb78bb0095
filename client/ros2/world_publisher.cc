#include "client/ros2/world_publisher.h"

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

#include "client/ros2/messages.h"
#include "core/api/tiles.h"
#include "core/codec/surface_tile_codec.h"
#include "core/common/status.h"
#include "core/common/steady_time.h"
#include "core/mls/surface_tile.h"
#include "core/mls/tile_key.h"

namespace strata::ros2 {
namespace {

// Floors of a large map take their time, and nobody drives by a map that is a second younger.
constexpr absl::Duration kLeastPause = absl::Seconds(1);
constexpr absl::Duration kLook = absl::Milliseconds(50);
// A map that begins has no floor for a moment.
constexpr absl::Duration kFloorMayCome = absl::Seconds(5);
// So far it drives before it may be on another floor.
constexpr double kStepM = 2.0;

bool Same(const OccupancyGrid& a, const OccupancyGrid& b) {
  return a.width == b.width && a.height == b.height && a.x_m == b.x_m && a.y_m == b.y_m &&
         a.cells == b.cells;
}

}  // namespace

absl::StatusOr<RobotProfile> FindProfile(api::Database& database,
                                         const api::Call& call,
                                         const std::string& map,
                                         const std::string& profile) {
  STRATA_ASSIGN_OR_RETURN(const auto profiles, database.planning().ListProfiles(call, map));
  const auto found = profiles.find(profile);
  if (found != profiles.end()) return found->second;
  return absl::NotFoundError(absl::StrCat("map ", map, ": no profile ", profile));
}

WorldPublisher::WorldPublisher(const Options& options,
                               const ServerLink& link,
                               const Where& where,
                               const Entity& grid_writer,
                               const Entity& surface_writer,
                               Talk& talk)
    : options_(options),
      link_(link),
      where_(where),
      grid_writer_(grid_writer),
      surface_writer_(surface_writer),
      talk_(talk),
      thread_([this] { Loop(); }) {}

WorldPublisher::~WorldPublisher() {
  stop_.Request();
  thread_.join();
}

bool WorldPublisher::Due(const Eigen::Vector3d& place) const {
  return !place_.has_value() || link_.changes() != changes_ || (place - *place_).norm() >= kStepM;
}

void WorldPublisher::Loop() {
  absl::Time earliest = SteadyNow(), good = earliest;
  while (!stop_.requested()) {
    absl::SleepFor(kLook);
    api::Database* const database = link_.database();
    const std::optional<Pose> T_map_base = where_.T_map_base();
    if (database == nullptr || !T_map_base.has_value() || link_.changes() == 0) continue;
    const Eigen::Vector3d place = T_map_base->translation();
    if (SteadyNow() < earliest || !Due(place)) continue;
    const std::uint64_t changes = link_.changes();
    const absl::Status published = Publish(*database, place);
    earliest = SteadyNow() + kLeastPause;
    if (stop_.requested()) break;
    if (absl::IsUnavailable(published)) continue;  // again; the spool's sender tells
    if (published.ok()) {
      good = SteadyNow();
      talk_.SayNew("floor", "the floor that the robot is on is published");
    } else if (SteadyNow() - good > kFloorMayCome) {
      talk_.SayNew("floor", std::string(published.message()));
    }
    place_ = place;
    changes_ = changes;
  }
}

absl::Status WorldPublisher::Publish(api::Database& database, const Eigen::Vector3d& place) {
  const absl::Status floor = PublishFloor(database, place);
  const absl::Status surfaces = PublishSurfaces(database, place);
  return floor.ok() ? surfaces : floor;
}

absl::Status WorldPublisher::PublishFloor(api::Database& database, const Eigen::Vector3d& place) {
  FloorQuery query;
  query.at = PlanEndpoint{.x_m = place.x(), .y_m = place.y(), .z_m = place.z()};
  query.cells = true;
  query.inferred = options_.inferred;
  STRATA_ASSIGN_OR_RETURN(query.profile,
                          FindProfile(database, link_.call(), options_.map, options_.profile));
  STRATA_ASSIGN_OR_RETURN(const FloorPlan plan,
                          database.planning().ListFloors(link_.call(), options_.map, query));
  cell_size_m_ = plan.cell_size_m;
  if (plan.floors.empty()) {
    return absl::NotFoundError(
        absl::StrCat("the map has no floor for profile ", options_.profile, " yet"));
  }
  if (!plan.at.has_value()) {
    return absl::NotFoundError(
        absl::StrFormat("the robot is on none of the map's %d floors for profile %s: no ground "
                        "within %.2f m of its "
                        "height on which it can stand",
                        plan.floors.size(),
                        options_.profile,
                        query.profile.height_m));
  }
  const Floor& floor = plan.floors[static_cast<std::size_t>(*plan.at)];
  STRATA_ASSIGN_OR_RETURN(OccupancyGrid grid, GridOf(floor, plan.cell_size_m));
  if (Same(grid, grid_)) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(
      WriteGrid(grid_writer_, {where_.map_frame(), where_.stamp_ns()}, grid, floor.mean_z_m));
  grid_ = std::move(grid);
  return absl::OkStatus();
}

absl::Status WorldPublisher::PublishSurfaces(api::Database& database,
                                             const Eigen::Vector3d& place) {
  if (cell_size_m_ <= 0.0) return absl::OkStatus();
  const double tile_m = cell_size_m_ * kTileCells;
  const auto x = static_cast<std::int64_t>(std::floor(place.x() / tile_m));
  const auto y = static_cast<std::int64_t>(std::floor(place.y() / tile_m));
  api::TileArea area;
  area.x_min = x - 1;
  area.x_max = x + 2;
  area.y_min = y - 1;
  area.y_max = y + 2;
  std::vector<SurfaceTile> tiles;
  STRATA_RETURN_IF_ERROR(database.tiles().Fetch(
      link_.call(), options_.map, area, {}, [&tiles](const api::TileUpdate& update) {
        if (update.tile.bytes.empty()) return absl::OkStatus();  // damaged: the rest is shown
        STRATA_ASSIGN_OR_RETURN(SurfaceTile tile, DecodeSurfaceTile(update.tile.bytes));
        tiles.push_back(std::move(tile));
        return absl::OkStatus();
      }));
  std::string bytes = SurfaceBytes(tiles, cell_size_m_);
  tiles.clear();
  if (bytes.empty()) return absl::OkStatus();
  return WriteSurfaces(surface_writer_, {where_.map_frame(), where_.stamp_ns()}, bytes);
}

}  // namespace strata::ros2
