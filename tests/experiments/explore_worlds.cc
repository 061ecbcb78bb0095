// A robot that drives where `Planning.Explore` says and looks from there, in drawn worlds, until no
// view is worth its way: how much of what it can reach does it know then, and how far did it drive?
//   reachable  places to stand in a map of all robots' tours, connected with the start: on all
//              storeys
//   known      share of them that the explored map has a surface at, within 0.15 m
//   way        until 95 % are known, and the tour of the world's own robots beside it
// Exits 1 unless 95 % are known in each world, after 1.3 times the tour at most.
//
//   explore_worlds [--seed 1] [--only rooms|car_park|building] [--each]
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "core/api/database.h"
#include "core/common/status.h"
#include "core/engine/engine.h"
#include "tests/support/database_suite/database_suite.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using Eigen::Vector3d;

constexpr double kHeightM = 1.0;
constexpr double kStepM = 2.0;
constexpr double kNearM = 0.15;
constexpr double kEnough = 0.95;
constexpr double kMostOfTour = 1.3;
constexpr std::size_t kMostViews = 150;

SensorOptions Sensor() {
  SensorOptions sensor;
  sensor.max_range_m = 20.0;
  return sensor;
}

FieldOfView FieldOf(const SensorOptions& sensor) {
  FieldOfView field;
  field.up_rad = sensor.elevation_max_rad;
  field.down_rad = -sensor.elevation_min_rad;
  field.rows = sensor.rings;
  field.columns = sensor.columns;
  field.max_range_m = sensor.max_range_m;
  return field;
}

// A map that scans of a scene go into, from where somebody says.
class ScannedMap {
 public:
  static absl::StatusOr<std::unique_ptr<ScannedMap>> Make(const Scene& scene, std::uint64_t seed) {
    auto map = std::unique_ptr<ScannedMap>(new ScannedMap(scene, seed));
    EngineOptions options;
    options.directory = map->directory_.path();
    STRATA_ASSIGN_OR_RETURN(map->db_, OpenEngine(options));
    MapParameters parameters;
    parameters.mls.cell_size_m = 0.2;
    STRATA_RETURN_IF_ERROR(map->db_->maps().Create({}, kMap, parameters).status());
    return map;
  }

  api::Database& db() { return *db_; }

  absl::Status Look(const Pose& T_map_sensor) {
    const PointCloud cloud = SimulateScan(scene_, Sensor(), T_map_sensor, seed_ + scans_);
    ScanHeader header = FloorHeader({"robot", scans_++}, cloud);
    header.T_map_scan = T_map_sensor;
    header.alignment = Alignment::kOff;
    return UploadScan(*db_, kMap, header, cloud).status();
  }

 private:
  ScannedMap(const Scene& scene, std::uint64_t seed) : scene_(scene), seed_(seed) {}

  const Scene& scene_;
  const std::uint64_t seed_;
  const TempDir directory_;
  std::unique_ptr<api::Database> db_;
  std::uint32_t scans_ = 0;
};

double LengthOf(const std::vector<Pose>& way) {
  double length_m = 0.0;
  for (std::size_t i = 1; i < way.size(); ++i) {
    length_m += (way[i].translation() - way[i - 1].translation()).norm();
  }
  return length_m;
}

// The places of floors that links join to that of the start.
absl::StatusOr<std::vector<Vector3d>> ReachablePlaces(api::Database& db, const Vector3d& start) {
  FloorQuery query;
  query.cells = true;
  STRATA_ASSIGN_OR_RETURN(const FloorPlan plan, db.planning().ListFloors({}, kMap, query));
  FloorQuery at;
  at.at = PlanEndpoint{start.x(), start.y(), start.z()};
  STRATA_ASSIGN_OR_RETURN(const FloorPlan where, db.planning().ListFloors({}, kMap, at));
  if (!where.at.has_value()) return absl::InternalError("the tour starts on no floor");
  std::vector<bool> joined(plan.floors.size(), false);
  joined[static_cast<std::size_t>(*where.at)] = true;
  for (std::size_t round = 0; round < plan.floors.size(); ++round) {
    for (const FloorLink& link : plan.links) {
      const auto a = static_cast<std::size_t>(link.a), b = static_cast<std::size_t>(link.b);
      if (joined[a] || joined[b]) joined[a] = joined[b] = true;
    }
  }
  std::vector<Vector3d> places;
  for (std::size_t f = 0; f < plan.floors.size(); ++f) {
    if (!joined[f]) continue;
    const Floor& floor = plan.floors[f];
    for (const FloorBlock& block : floor.blocks) {
      for (int bit = 0; bit < 64; ++bit) {
        if ((block.free >> bit & 1U) == 0) continue;
        const double x = block.x * kFloorBlockCells + bit % kFloorBlockCells + 0.5;
        const double y = block.y * kFloorBlockCells + bit / kFloorBlockCells + 0.5;
        places.emplace_back(x * plan.cell_size_m, y * plan.cell_size_m, floor.mean_z_m);
      }
    }
  }
  return places;
}

// Of each place the surface of the map that is nearest to its floor.
absl::Status OnSurfaces(api::Database& db, std::vector<Vector3d>& places) {
  std::vector<Eigen::Vector2d> at;
  for (const Vector3d& p : places) at.emplace_back(p.head<2>());
  STRATA_ASSIGN_OR_RETURN(const std::vector<SurfaceColumn> columns,
                          db.planning().SampleSurfaces({}, kMap, at));
  for (std::size_t i = 0; i < places.size(); ++i) {
    double nearest = INFINITY;
    for (const Surface& surface : columns[i].surfaces) {
      const double z = static_cast<double>(surface.z_m);
      if (std::abs(z - places[i].z()) < std::abs(nearest - places[i].z())) nearest = z;
    }
    places[i].z() = nearest;
  }
  return absl::OkStatus();
}

absl::StatusOr<double> KnownShare(api::Database& db, const std::vector<Vector3d>& places) {
  std::vector<Vector3d> seen = places;
  STRATA_RETURN_IF_ERROR(OnSurfaces(db, seen));
  std::size_t known = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    known += std::abs(seen[i].z() - places[i].z()) <= kNearM ? 1 : 0;
  }
  return static_cast<double>(known) / static_cast<double>(places.size());
}

struct Explored {
  std::size_t views = 0;
  double way_m = 0.0;              // in all
  double known = 0.0;              // at the end
  std::optional<double> enough_m;  // the way until 95 % were known
  std::string end;
};

absl::StatusOr<Explored> ExploreFrom(ScannedMap& map,
                                     Vector3d place,
                                     const std::vector<Vector3d>& reachable,
                                     bool each) {
  Explored explored;
  ExploreQuery query;
  query.sensor = FieldOf(Sensor());
  query.sensor_height_m = kHeightM;
  query.count = 1;
  query.budget_m = 100.0;
  query.resolution_m = 0.25;
  while (explored.views < kMostViews) {
    query.from = {place.x(), place.y(), place.z()};
    STRATA_ASSIGN_OR_RETURN(const ExploreResult next, map.db().planning().Explore({}, kMap, query));
    explored.end = next.message;
    if (next.views.empty()) break;
    const ExploreView& view = next.views[0];
    PlanQuery way;
    way.from = query.from;
    way.to = {view.place.x(), view.place.y(), view.place.z()};
    STRATA_ASSIGN_OR_RETURN(const PlanResult path, map.db().planning().PlanPath({}, kMap, way));
    if (!path.found()) return absl::InternalError("no way to a view: " + path.message);
    explored.way_m += path.length_m;
    ++explored.views;
    place = view.place;
    STRATA_RETURN_IF_ERROR(map.Look(view.T_map_sensor));
    AwaitIntegration(map.db(), kMap);
    STRATA_ASSIGN_OR_RETURN(explored.known, KnownShare(map.db(), reachable));
    if (each) {
      std::printf("    view %zu at %.1f, %.1f, %.1f: %.0f bits, way %.1f m, known %.1f %%\n",
                  explored.views,
                  place.x(),
                  place.y(),
                  place.z(),
                  view.gain_bits,
                  explored.way_m,
                  100.0 * explored.known);
    }
    if (explored.known >= kEnough && !explored.enough_m.has_value()) {
      explored.enough_m = explored.way_m;
    }
  }
  return explored;
}

absl::StatusOr<bool> RunWorld(const std::string& name,
                              const World& world,
                              std::uint64_t seed,
                              bool each) {
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<ScannedMap> toured,
                          ScannedMap::Make(world.scene, seed));
  double tour_m = 0.0;
  std::optional<Pose> start;
  for (const Robot& robot : world.robots) {
    const std::vector<Pose> way = Drive(world.scene, robot.waypoints, kStepM, kHeightM);
    tour_m += LengthOf(way);
    for (const Pose& pose : way) STRATA_RETURN_IF_ERROR(toured->Look(pose));
    if (!start.has_value()) start = way.front();
  }
  AwaitIntegration(toured->db(), kMap);
  const Vector3d place = start->translation() - kHeightM * Vector3d::UnitZ();
  STRATA_ASSIGN_OR_RETURN(std::vector<Vector3d> reachable, ReachablePlaces(toured->db(), place));
  STRATA_RETURN_IF_ERROR(OnSurfaces(toured->db(), reachable));
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<ScannedMap> map,
                          ScannedMap::Make(world.scene, seed + 1'000));
  STRATA_RETURN_IF_ERROR(map->Look(*start));
  AwaitIntegration(map->db(), kMap);
  STRATA_ASSIGN_OR_RETURN(const Explored explored, ExploreFrom(*map, place, reachable, each));
  const bool holds = explored.enough_m.has_value() && *explored.enough_m <= kMostOfTour * tour_m;
  std::printf("%-9s %llu: %zu views, %.0f m, %.1f %% of %zu places known at the end (%s)\n",
              name.c_str(),
              static_cast<unsigned long long>(seed),
              explored.views,
              explored.way_m,
              100.0 * explored.known,
              reachable.size(),
              explored.end.c_str());
  std::printf("%s: 95 %% known after %.0f m; the tour is %.0f m\n",
              holds ? "holds" : "FAILS",
              explored.enough_m.value_or(NAN),
              tour_m);
  return holds;
}

int Main(int argc, char** argv) {
  CLI::App app("A robot that drives where it is told to look");
  std::uint64_t seed = 1;
  std::string only;
  bool each = false;
  app.add_option("--seed", seed);
  app.add_option("--only", only)->check(CLI::IsMember({"rooms", "car_park", "building"}));
  app.add_flag("--each", each);
  CLI11_PARSE(app, argc, argv);
  bool all = true;
  for (const std::string name : {"rooms", "car_park", "building"}) {
    if (!only.empty() && only != name) continue;
    const World world = name == "rooms"      ? RoomsWorld(0.1, seed)
                        : name == "car_park" ? CarParkWorld()
                                             : BuildingWorld(seed);
    const absl::StatusOr<bool> holds = RunWorld(name, world, seed, each);
    if (!holds.ok()) {
      std::fprintf(stderr, "%s: %s\n", name.c_str(), holds.status().ToString().c_str());
      return 1;
    }
    all &= *holds;
  }
  return all ? 0 : 1;
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) { return strata::testing::Main(argc, argv); }
