// A simulated robot explores drawn worlds by Planning.Explore: does it see all that it can reach,
// on all levels, without driving much more than a person would?
//
//   explore_worlds [--seed 1] [--draws 3] [--worlds car_park,building] [--each]
//
// A draw chooses the world (the car park is always the same), where the robot starts on the lowest
// level, and the noise of its sensor. It scans there, drives 2.5 m straight on, for it does not see
// the ground that it stands on, and then asks for the best view, drives to it as PlanPath says, and
// scans every metre and at the view, at its true pose, until no view is worth it. The sensor has 64
// beams of 20 m above each other, 1 m over the ground; beams that nothing came back from are sent
// as points beyond its range.
//   reached  share of the places that a robot can drive to in the map of a sensor that has been
//            everywhere, and that it can drive to in this map, by levels
//   driven   beside a tour made by hand, which is also mapped, with the same sensor
// Exits 1 unless in every draw 95 % of each level are reached, for 1.3 times the tour at most.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <CLI/CLI.hpp>
#include <Eigen/Geometry>

#include "core/api/database.h"
#include "core/common/status.h"
#include "core/engine/engine.h"
#include "core/world/exploration.h"
#include "tests/experiments/exploring/explored_site.h"
#include "tests/experiments/exploring/reached_ground.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

using Eigen::Vector3d;

constexpr char kTruth[] = "truth";
constexpr char kTour[] = "tour";
constexpr char kExplored[] = "explored";
constexpr double kStepM = 1.0;    // between scans
constexpr double kFollowM = 0.1;  // between poses that are looked at
constexpr double kTruthSpacingM = 2.0;
constexpr double kSensorHeightM = 1.0;
constexpr double kStartM = 2.5;
constexpr double kLeastUpright = 0.9;  // cosine of a robot's tilt, beyond its steepest slope
constexpr int kMostViews = 150;
constexpr double kLeastReached = 0.95;
constexpr double kMostTours = 1.3;

// Beams of `field` as the simulator has them.
SensorOptions SensorOf(const FieldOfView& field) {
  const double spacing = (field.up_rad + field.down_rad) / field.rows;
  SensorOptions sensor;
  sensor.rings = field.rows;
  sensor.columns = field.columns;
  sensor.elevation_min_rad = -field.down_rad + 0.5 * spacing;
  sensor.elevation_max_rad = field.up_rad - 0.5 * spacing;
  sensor.max_range_m = field.max_range_m;
  sensor.no_return_m = field.max_range_m + 1.0;
  return sensor;
}

// Sees nearly all around.
SensorOptions TruthSensor() {
  SensorOptions sensor;
  sensor.rings = 64;
  sensor.columns = 480;
  sensor.elevation_min_rad = -1.4;
  sensor.max_range_m = 12.0;
  sensor.sigma_m = 0.002;
  sensor.sigma_per_metre = 0.0;
  return sensor;
}

Pose Above(const Vector3d& ground) {
  return Pose(Eigen::Translation3d(ground + kSensorHeightM * Vector3d::UnitZ()));
}

// Of one map.
class Mapper {
 public:
  Mapper(api::Database& db,
         std::string map,
         const Scene& scene,
         const SensorOptions& sensor,
         std::uint64_t seed)
      : db_(db), map_(std::move(map)), scene_(scene), sensor_(sensor), seed_(seed) {}

  absl::Status Create() { return db_.maps().Create({}, map_, {}).status(); }

  absl::Status Scan(const Pose& T_map_sensor) {
    const PointCloud cloud = SimulateScan(scene_, sensor_, T_map_sensor, seed_ + sent_);
    ScanHeader header;
    header.id = {"robot", ++sent_};
    header.T_map_scan = T_map_sensor;
    header.alignment = Alignment::kOff;
    header.sensor = SensorModel{};
    header.sensor->max_range_m = sensor_.max_range_m;
    header.point_count = cloud.size();
    STRATA_ASSIGN_OR_RETURN(const auto upload, db_.scans().Upload({}, map_, header));
    PointCloud piece;
    for (std::size_t i = 0; i < cloud.size(); i += api::kMaxPointsPerChunk) {
      const std::size_t end = std::min(cloud.size(), i + api::kMaxPointsPerChunk);
      piece.points.assign(cloud.points.begin() + static_cast<std::ptrdiff_t>(i),
                          cloud.points.begin() + static_cast<std::ptrdiff_t>(end));
      STRATA_RETURN_IF_ERROR(upload->Write(piece));
    }
    return upload->Finish().status();
  }

  // Scans on the way and at its end, but not where it begins.
  absl::Status DriveAlong(const std::vector<Vector3d>& waypoints) {
    const std::vector<Pose> poses = Drive(scene_, waypoints, kFollowM, kSensorHeightM);
    const std::vector<Pose> ground = Drive(scene_, waypoints, kFollowM, 0.0);
    const auto every = static_cast<std::size_t>(kStepM / kFollowM);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if ((i == 0 || i % every != 0) && i + 1 != poses.size()) continue;
      // Drive()'s wheels are a metre apart and fall off the ramp where this robot stands at its
      // edge.
      const bool falls = poses[i].linear()(2, 2) < kLeastUpright;
      STRATA_RETURN_IF_ERROR(Scan(falls ? Above(ground[i].translation()) : poses[i]));
    }
    if (poses.empty()) STRATA_RETURN_IF_ERROR(Scan(Above(waypoints.back())));  // it is there
    driven_m_ += LengthOf(waypoints);
    return AwaitIntegrated();
  }

  absl::Status AwaitIntegrated() {
    while (true) {
      STRATA_ASSIGN_OR_RETURN(const MapStats stats, db_.maps().Stats({}, map_));
      if (stats.scans_pending == 0) return absl::OkStatus();
      absl::SleepFor(absl::Milliseconds(5));
    }
  }

  std::uint64_t sent() const { return sent_; }
  double driven_m() const { return driven_m_; }

 private:
  api::Database& db_;
  const std::string map_;
  const Scene& scene_;
  const SensorOptions sensor_;
  const std::uint64_t seed_;
  std::uint64_t sent_ = 0;
  double driven_m_ = 0.0;
};

PlanEndpoint At(const Vector3d& place) {
  return {.x_m = place.x(), .y_m = place.y(), .z_m = place.z()};
}

// A site, and what can be reached there.
struct Task {
  ExploredSite site;
  std::vector<Vector3d> truth;
  ExploreQuery query;
  bool each = false;
};

struct Shares {
  std::vector<double> by_level;
  std::string text;
  double least() const { return *std::min_element(by_level.begin(), by_level.end()); }
};

Shares SharesOf(const Task& task, const std::vector<Vector3d>& missing) {
  Shares shares;
  for (const ExploredSite::Level& level : task.site.levels) {
    const auto count = [&level](const std::vector<Vector3d>& places) {
      return std::count_if(places.begin(), places.end(), [&level](const Vector3d& p) {
        return p.z() >= level.low_m && p.z() < level.high_m;
      });
    };
    const double share =
        1.0 - static_cast<double>(count(missing)) /
                  static_cast<double>(std::max<std::ptrdiff_t>(1, count(task.truth)));
    shares.by_level.push_back(share);
    absl::StrAppendFormat(&shares.text, " %s %.1f %%", level.name, 100.0 * share);
  }
  return shares;
}

// Where what was not reached is, in squares of 2 m, the largest first.
void PrintMissing(const std::vector<Vector3d>& missing) {
  std::map<std::array<int, 3>, int> squares;
  for (const Vector3d& p : missing) {
    const Eigen::Vector3i at = (p / 2.0).array().floor().cast<int>();
    ++squares[{at.x(), at.y(), at.z()}];
  }
  std::vector<std::pair<int, std::array<int, 3>>> sorted;
  for (const auto& [at, cells] : squares) sorted.push_back({cells, at});
  std::sort(sorted.rbegin(), sorted.rend());
  for (std::size_t i = 0; i < std::min<std::size_t>(sorted.size(), 25); ++i) {
    const auto& [cells, at] = sorted[i];
    std::printf("    %4d cells at %d..%d, %d..%d, z %d\n",
                cells,
                2 * at[0],
                2 * at[0] + 2,
                2 * at[1],
                2 * at[1] + 2,
                2 * at[2]);
  }
}

absl::StatusOr<Shares> Judge(api::Database& db,
                             const char* map,
                             const Task& task,
                             const Vector3d& from) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<Vector3d> reached,
                          ReachedGround(db, map, task.query.profile, At(from)));
  const std::vector<Vector3d> missing = NotReached(task.truth, reached);
  if (task.each) PrintMissing(missing);
  return SharesOf(task, missing);
}

// Fills `truth`: what is reached in the region from where the tour leads.
absl::Status MapTruth(api::Database& db, std::uint64_t seed, Task& task) {
  Mapper mapper(db, kTruth, task.site.world.scene, TruthSensor(), seed);
  STRATA_RETURN_IF_ERROR(mapper.Create());
  for (const Vector3d& place : Everywhere(task.site, kTruthSpacingM, kSensorHeightM)) {
    STRATA_RETURN_IF_ERROR(mapper.Scan(Pose(Eigen::Translation3d(place))));
  }
  STRATA_RETURN_IF_ERROR(mapper.AwaitIntegrated());
  STRATA_ASSIGN_OR_RETURN(const std::vector<Vector3d> reached,
                          ReachedGround(db, kTruth, task.query.profile, At(task.site.tour.at(1))));
  std::copy_if(
      reached.begin(), reached.end(), std::back_inserter(task.truth), [&](const Vector3d& p) {
        return task.site.region.contains(p);
      });
  return absl::OkStatus();
}

absl::StatusOr<Shares> MapTour(api::Database& db, std::uint64_t seed, const Task& task) {
  Mapper mapper(db, kTour, task.site.world.scene, SensorOf(task.query.sensor), seed);
  STRATA_RETURN_IF_ERROR(mapper.Create());
  STRATA_RETURN_IF_ERROR(mapper.DriveAlong(task.site.tour));
  return Judge(db, kTour, task, task.site.tour.at(1));
}

// A place on the lowest level from which it can drive straight on to the other.
std::pair<Vector3d, Vector3d> DrawStart(const Task& task, Random& random) {
  while (true) {
    const Vector3d start = task.truth[random.Bits() % task.truth.size()];
    if (start.z() >= task.site.levels.front().high_m) continue;
    const double yaw = random.Uniform(-M_PI, M_PI);
    const Vector3d ahead(std::cos(yaw), std::sin(yaw), 0.0);
    std::vector<Vector3d> way;
    for (double x = 0.0; x <= kStartM; x += kFollowM) {
      const Vector3d at = start + x * ahead;
      way.emplace_back((std::floor(at.x() / 0.1) + 0.5) * 0.1,
                       (std::floor(at.y() / 0.1) + 0.5) * 0.1,
                       start.z());
    }
    if (NotReached(way, task.truth).empty()) return {start, start + kStartM * ahead};
  }
}

// Until no view is worth it. Returns why it ended.
absl::StatusOr<std::string> ExploreAll(api::Database& db,
                                       const Task& task,
                                       Vector3d at,
                                       Mapper& mapper) {
  ExploreQuery query = task.query;
  for (int i = 0; i < kMostViews; ++i) {
    query.from = At(at);
    STRATA_ASSIGN_OR_RETURN(const ExploreResult next, db.planning().Explore({}, kExplored, query));
    if (next.views.empty()) return next.message;
    const ExploreView& view = next.views.front();
    PlanQuery plan;
    plan.from = query.from;
    plan.to = At(view.place);
    plan.profile = query.profile;
    STRATA_ASSIGN_OR_RETURN(const PlanResult path, db.planning().PlanPath({}, kExplored, plan));
    if (!path.found()) return absl::StrCat("no way to a view: ", path.message);
    if (task.each) {
      std::printf("    view %2d at (%.1f, %.1f, %.1f): %.0f bits, %.1f m, %.0f ms\n",
                  i + 1,
                  view.place.x(),
                  view.place.y(),
                  view.place.z(),
                  view.gain_bits,
                  path.length_m,
                  next.elapsed_ms);
      std::fflush(stdout);
    }
    STRATA_RETURN_IF_ERROR(mapper.DriveAlong(path.waypoints));
    at = path.waypoints.back();
  }
  return absl::StrCat("not explored after ", kMostViews, " views");
}

absl::StatusOr<bool> Draw(const std::string& name,
                          std::uint64_t seed,
                          const ExploreQuery& query,
                          bool each) {
  Task task{SiteOf(name, seed), {}, query, each};
  task.query.region = task.site.region;
  const TempDir directory;
  EngineOptions options;
  options.directory = directory.path();
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::Database> db, OpenEngine(options));
  Random random(seed);
  STRATA_RETURN_IF_ERROR(MapTruth(*db, random.Bits(), task));
  STRATA_ASSIGN_OR_RETURN(const Shares by_hand, MapTour(*db, random.Bits(), task));
  const auto [start, ahead] = DrawStart(task, random);
  Mapper mapper(*db, kExplored, task.site.world.scene, SensorOf(query.sensor), random.Bits());
  STRATA_RETURN_IF_ERROR(mapper.Create());
  STRATA_RETURN_IF_ERROR(mapper.Scan(Above(start)));
  STRATA_RETURN_IF_ERROR(mapper.DriveAlong({start, ahead}));
  STRATA_ASSIGN_OR_RETURN(const std::string end, ExploreAll(*db, task, ahead, mapper));
  STRATA_ASSIGN_OR_RETURN(const Shares explored, Judge(*db, kExplored, task, ahead));
  const double tour_m = LengthOf(task.site.tour);
  const bool holds = explored.least() >= kLeastReached && mapper.driven_m() <= kMostTours * tour_m;
  std::printf(
      "%-9s seed %-6llu %5.0f m2 to reach: by %3llu scans%s after %.0f m (%.2f tours); tour of "
      "%.0f m:%s; %s%s\n",
      name.c_str(),
      static_cast<unsigned long long>(seed),
      0.01 * static_cast<double>(task.truth.size()),
      static_cast<unsigned long long>(mapper.sent()),
      explored.text.c_str(),
      mapper.driven_m(),
      mapper.driven_m() / tour_m,
      tour_m,
      by_hand.text.c_str(),
      end.c_str(),
      holds ? "" : "  FAILED");
  std::fflush(stdout);
  return holds;
}

int Main(int argc, char** argv) {
  CLI::App app("A simulated robot explores drawn worlds", "explore_worlds");
  std::uint64_t seed = 1;
  int draws = 3;
  std::vector<std::string> worlds = {"car_park", "building"};
  bool each = false;
  ExploreQuery query;
  query.count = 1;
  query.budget_m = 300.0;
  query.sensor_height_m = kSensorHeightM;
  query.min_bits = 2000.0;
  query.bits_per_m = 300.0;
  query.sensor.rows = 64;
  query.sensor.columns = 720;
  app.add_option("--seed", seed, "Of the first draw");
  app.add_option("--draws", draws, "Of each world");
  app.add_option("--worlds", worlds, "car_park, building")->delimiter(',');
  app.add_option("--resolution", query.resolution_m, "Of Explore");
  app.add_option("--bits-per-metre", query.bits_per_m, "Of Explore");
  app.add_option("--min-bits", query.min_bits, "Of Explore");
  app.add_flag("--each", each, "Print every view, and where what was not reached is");
  CLI11_PARSE(app, argc, argv);
  bool holds = true;
  for (int d = 0; d < draws; ++d, ++seed) {
    for (const std::string& world : worlds) {
      const absl::StatusOr<bool> drawn = Draw(world, seed, query, each);
      if (!drawn.ok()) {
        std::fprintf(stderr, "%s\n", drawn.status().ToString().c_str());
        return 2;
      }
      holds = *drawn && holds;
    }
  }
  std::puts(holds ? "HOLDS: explored like by hand" : "FAILS");
  return holds ? 0 : 1;
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) { return strata::testing::Main(argc, argv); }
