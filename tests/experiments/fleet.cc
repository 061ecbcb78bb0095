// Several robots drive through a drawn world, each a stretch of one way, and send their scans in
// any order. Is where they are said to be to each other right?
//
//   fleet [--seed 1] [--draws 10] [--worlds campus_loop,car_park,…] [--frames one,off,own,jump]
//         [--mounts level,tilted,upright,handheld,cone] [--each]
//
// A draw chooses the number of robots (2 to 5), their stretches (neighbours have up to 10 scans of
// 2 m in common, or none), the sensor (rings, columns, range), and the order of uploads. Frames:
//   one   all robots begin where the world says (noise of odometry from there on)
//   off   each is 1 m and 0.1 rad off at its start (σ an axis, height 0.1 m)
//   own   each has an origin and a heading of its own, 50 to 300 m from the others
//   jump  it is one robot, whose odometry jumps by up to 6 m and 0.4 rad between its stretches
// and mounts, which take turns:
//   level     on a vehicle, its rings around what is up there
//   tilted    looks down in front, by 0.3 to 0.7 rad
//   upright   lies on its side, so that a turn goes over the head
//   handheld  is carried: rolls, pitches (σ 0.1 rad) and bobs (σ 0.1 m) from scan to scan
//   cone      sees 1.4 rad in front only, as densely as solid-state sensors do
// Two robots are right to each other if their middle scans are, to 1 m. `optimize` keeps the first
// scan of what it joins where it was said to be. So after it a robot is
//   joined  right to another one
//   alone   right to nobody, and its first scan is where it was said to be, to 1 m
//   wrong   neither it nor any robot that is right to it is where it was said to be
// A fleet that stays apart costs coverage, a wrong one the map: exits 1 if any robot is wrong. How
// far those that are right to each other are off at most is printed beside.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <CLI/CLI.hpp>

#include "core/api/database.h"
#include "core/common/disjoint_sets.h"
#include "core/common/status.h"
#include "core/engine/engine.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

constexpr char kMap[] = "fleet";
constexpr double kRightM = 1.0;
constexpr double kStepM = 2.0;
constexpr double kSensorHeightM = 1.2;

// How a drive carries its sensor.
struct Mount {
  std::string kind;
  double half_view_rad = M_PI;  // of what is seen, on both sides of the front
};

struct FleetRobot {
  std::string name;  // of its trajectory
  std::vector<Pose> truth;
  std::vector<Pose> said;
  std::size_t before = 0;  // scans of the trajectory, in other stretches of it
  std::size_t sent = 0;

  ScanId Id(std::size_t k) const { return {name, before + k + 1}; }
};

World WorldOf(const std::string& name, std::uint64_t seed) {
  if (name == "car_park") return CarParkWorld();
  if (name == "rooms") return RoomsWorld(0.1, seed);
  if (name == "building") return BuildingWorld(seed);
  if (name == "campus") return CampusWorld(seed);
  if (name == "bridge") return BridgeWorld();
  return CampusLoopWorld(seed);
}

Pose Upright(double x_m, double y_m, double z_m, double heading_rad) {
  return Pose(Eigen::Translation3d(x_m, y_m, z_m) *
              Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()));
}

Pose OffOf(const std::string& frames, Random& random) {
  if (frames == "one") return Pose::Identity();
  const bool own = frames == "own";
  const double turn = own ? random.Uniform(-M_PI, M_PI) : 0.1 * random.Gaussian();
  const double x = own ? random.Uniform(50.0, 300.0) : random.Gaussian();
  const double y = own ? random.Uniform(-200.0, 200.0) : random.Gaussian();
  const double z = 0.1 * random.Gaussian();
  return Upright(x, y, z, turn);
}

Pose Turned(double angle_rad, const Eigen::Vector3d& axis) {
  return Pose(Eigen::AngleAxisd(angle_rad, axis));
}

std::vector<Pose> WayOf(const World& world, const Mount& mount, Random random) {
  const Robot& driver = world.loops.empty() ? world.robots.front() : world.loops.front();
  std::vector<Pose> way = Drive(world.scene, driver.waypoints, kStepM, kSensorHeightM);
  const double down_rad = random.Uniform(0.3, 0.7);
  for (Pose& pose : way) {
    if (mount.kind == "tilted") pose = pose * Turned(down_rad, Eigen::Vector3d::UnitY());
    if (mount.kind == "upright") pose = pose * Turned(M_PI / 2, Eigen::Vector3d::UnitX());
    if (mount.kind != "handheld") continue;
    pose = Pose(Eigen::Translation3d(0.0, 0.0, 0.1 * random.Gaussian())) * pose *
           Turned(0.1 * random.Gaussian(), Eigen::Vector3d::UnitY()) *
           Turned(0.1 * random.Gaussian(), Eigen::Vector3d::UnitX());
  }
  return way;
}

std::vector<FleetRobot> FleetOf(const std::vector<Pose>& way,
                                const std::string& frames,
                                Random& random) {
  const auto count = static_cast<std::size_t>(random.Uniform(2.0, 6.0));
  std::vector<FleetRobot> robots;
  for (std::size_t r = 0; r < count; ++r) {
    const auto common = static_cast<std::size_t>(random.Uniform(0.0, 11.0));
    const std::size_t begin = r * way.size() / count;
    const std::size_t end = std::min(way.size(), (r + 1) * way.size() / count + common);
    FleetRobot& robot = robots.emplace_back();
    robot.name = "robot" + std::to_string(r);
    robot.truth.assign(way.begin() + static_cast<std::ptrdiff_t>(begin),
                       way.begin() + static_cast<std::ptrdiff_t>(end));
    const Pose off = r == 0 ? Pose::Identity() : OffOf(frames, random);
    const Pose start = robot.truth.front();
    for (const Pose& pose : NoisyOdometry(robot.truth, OdometryNoise(), random.Bits())) {
      // Off in its own start, or everything with the origin.
      robot.said.push_back(frames == "own" ? off * pose : start * off * start.inverse() * pose);
    }
  }
  return robots;
}

// The stretches of one robot.
std::vector<FleetRobot> JumpsOf(const std::vector<Pose>& way, Random& random) {
  const std::vector<Pose> odometry = NoisyOdometry(way, OdometryNoise(), random.Bits());
  const auto count = static_cast<std::size_t>(random.Uniform(2.0, 6.0));
  std::vector<FleetRobot> stretches;
  Pose off = Pose::Identity();
  for (std::size_t r = 0; r < count; ++r) {
    const std::size_t begin = r * way.size() / count;
    const std::size_t end = (r + 1) * way.size() / count;
    if (r > 0) {
      const double far = random.Uniform(0.0, 6.0);
      const double towards = random.Uniform(-M_PI, M_PI);
      const double turn = random.Uniform(-0.4, 0.4);
      const Pose start = off * odometry[begin];
      off = start * Upright(far * std::cos(towards), far * std::sin(towards), 0.0, turn) *
            start.inverse() * off;
    }
    FleetRobot& stretch = stretches.emplace_back();
    stretch.name = "robot";
    stretch.before = begin;
    for (std::size_t k = begin; k < end; ++k) {
      stretch.truth.push_back(way[k]);
      stretch.said.push_back(off * odometry[k]);
    }
  }
  return stretches;
}

SensorOptions SensorOf(Random& random) {
  constexpr std::array<int, 3> kRings = {16, 32, 48};
  constexpr std::array<int, 3> kColumns = {240, 360, 720};
  SensorOptions sensor;
  sensor.rings = kRings.at(random.Bits() % kRings.size());
  sensor.columns = kColumns.at(random.Bits() % kColumns.size());
  sensor.max_range_m = random.Uniform(20.0, 60.0);
  return sensor;
}

PointCloud InView(const PointCloud& cloud, const Mount& mount) {
  PointCloud seen;
  for (const Eigen::Vector3f& point : cloud.points) {
    if (std::abs(std::atan2(point.y(), point.x())) <= mount.half_view_rad) {
      seen.points.push_back(point);
    }
  }
  return seen;
}

absl::Status Send(api::Database& db,
                  const Scene& scene,
                  const SensorOptions& sensor,
                  const Mount& mount,
                  std::uint64_t seed,
                  FleetRobot& robot) {
  const std::size_t k = robot.sent++;
  const PointCloud cloud = InView(SimulateScan(scene, sensor, robot.truth[k], seed), mount);
  ScanHeader header;
  header.id = robot.Id(k);
  header.T_map_scan = robot.said[k];
  header.point_count = cloud.size();
  STRATA_ASSIGN_OR_RETURN(const auto upload, db.scans().Upload({}, kMap, header));
  STRATA_RETURN_IF_ERROR(upload->Write(cloud));
  return upload->Finish().status();
}

absl::Status AwaitIntegrated(api::Database& db) {
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const MapStats stats, db.maps().Stats({}, kMap));
    if (stats.scans_pending == 0) return absl::OkStatus();
    absl::SleepFor(absl::Milliseconds(10));
  }
}

absl::StatusOr<JobInfo> Optimize(api::Database& db) {
  STRATA_ASSIGN_OR_RETURN(const JobInfo started, db.jobs().Start({}, kMap, "optimize", {}));
  JobInfo last;
  STRATA_RETURN_IF_ERROR(db.jobs().Watch({}, kMap, started.id, [&](const JobInfo& now) {
    last = now;
    return absl::OkStatus();
  }));
  return last;
}

struct Verdicts {
  int joined = 0, alone = 0, wrong = 0;
  double off_m = 0.0;  // of those that are right to each other, at most
};

absl::StatusOr<Pose> PoseOf(api::Database& db, const FleetRobot& robot, std::size_t k) {
  STRATA_ASSIGN_OR_RETURN(const ScanInfo scan, db.scans().Get({}, kMap, robot.Id(k)));
  return scan.T_map_scan;
}

// How far the first scan of the r-th is from where it was said to be [m].
absl::StatusOr<double> Moved(api::Database& db,
                             const std::vector<FleetRobot>& robots,
                             std::size_t r) {
  STRATA_ASSIGN_OR_RETURN(const Pose first, PoseOf(db, robots[r], 0));
  Pose said = robots[r].said[0];
  if (robots[r].before > 0) {
    const FleetRobot& before = robots[r - 1];
    STRATA_ASSIGN_OR_RETURN(const Pose last, PoseOf(db, before, before.said.size() - 1));
    said = last * before.said.back().inverse() * said;
  }
  return (first.translation() - said.translation()).norm();
}

// To each other, of their middle scans [m].
absl::StatusOr<double> Error(api::Database& db, const FleetRobot& a, const FleetRobot& b) {
  const std::size_t middle_a = a.truth.size() / 2;
  const std::size_t middle_b = b.truth.size() / 2;
  STRATA_ASSIGN_OR_RETURN(const Pose T_map_a, PoseOf(db, a, middle_a));
  STRATA_ASSIGN_OR_RETURN(const Pose T_map_b, PoseOf(db, b, middle_b));
  const Pose is = T_map_b.inverse() * T_map_a;
  const Pose truth = b.truth[middle_b].inverse() * a.truth[middle_a];
  return (is.translation() - truth.translation()).norm();
}

// Names the wrong ones.
absl::StatusOr<Verdicts> Judge(api::Database& db, const std::vector<FleetRobot>& robots) {
  Verdicts verdicts;
  DisjointSets right;
  std::vector<std::vector<double>> errors(robots.size());
  for (std::size_t a = 0; a < robots.size(); ++a) {
    for (std::size_t b = 0; b < robots.size(); ++b) {
      STRATA_ASSIGN_OR_RETURN(errors[a].emplace_back(), Error(db, robots[a], robots[b]));
      if (errors[a][b] > kRightM) continue;
      right.Join(a, b);
      verdicts.off_m = std::max(verdicts.off_m, errors[a][b]);
    }
  }
  std::vector<bool> holds(robots.size(), false);
  std::vector<int> size(robots.size(), 0);
  for (std::size_t a = 0; a < robots.size(); ++a) {
    STRATA_ASSIGN_OR_RETURN(const double moved, Moved(db, robots, a));
    if (moved <= kRightM) holds[right.Root(a)] = true;
    ++size[right.Root(a)];
  }
  for (std::size_t a = 0; a < robots.size(); ++a) {
    const std::size_t root = right.Root(a);
    if (holds[root]) {
      ++(size[root] > 1 ? verdicts.joined : verdicts.alone);
      continue;
    }
    ++verdicts.wrong;
    STRATA_ASSIGN_OR_RETURN(const double moved, Moved(db, robots, a));
    std::printf("    %s moved by %.2f m, errors", robots[a].name.c_str(), moved);
    for (const double error : errors[a]) std::printf(" %.2f", error);
    std::puts(" m");
  }
  return verdicts;
}

// How far each step is from the truth, and what ingest said of it. Of stretches of one robot, steps
// across jumps are among them.
absl::Status PrintSteps(api::Database& db, const std::vector<FleetRobot>& robots) {
  ScanId last;
  Pose T_world_last = Pose::Identity();
  for (const FleetRobot& robot : robots) {
    for (std::size_t k = 0; k < robot.truth.size(); ++k) {
      const ScanId before = std::exchange(last, robot.Id(k));
      const Pose T_world_before = std::exchange(T_world_last, robot.truth[k]);
      if (before.trajectory != robot.name) continue;
      STRATA_ASSIGN_OR_RETURN(const ScanInfo from, db.scans().Get({}, kMap, before));
      STRATA_ASSIGN_OR_RETURN(const ScanInfo scan, db.scans().Get({}, kMap, robot.Id(k)));
      const Pose error = (T_world_before.inverse() * robot.truth[k]).inverse() *
                         (from.T_map_scan.inverse() * scan.T_map_scan);
      std::printf("    %s %llu: %.3f m %.4f rad, overlap %.2f, %s\n",
                  robot.name.c_str(),
                  static_cast<unsigned long long>(robot.Id(k).sequence),
                  error.translation().norm(),
                  RotationAngleRad(error),
                  scan.alignment.overlap,
                  scan.alignment.message.c_str());
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<Verdicts> Draw(const std::string& name,
                              const std::string& frames,
                              const Mount& mount,
                              std::uint64_t seed,
                              bool each) {
  Random random(seed);
  const World world = WorldOf(name, seed);
  const std::vector<Pose> way = WayOf(world, mount, Random(seed));
  const bool is_one = frames == "jump";
  std::vector<FleetRobot> robots = is_one ? JumpsOf(way, random) : FleetOf(way, frames, random);
  SensorOptions sensor = SensorOf(random);
  if (mount.kind == "cone") {
    sensor.rings = 48;
    sensor.columns = 1440;
  }
  const TempDir directory;
  EngineOptions options;
  options.directory = directory.path();
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::Database> db, OpenEngine(options));
  STRATA_RETURN_IF_ERROR(db->maps().Create({}, kMap, {}).status());
  std::size_t scans = 0;
  while (true) {
    std::vector<FleetRobot*> left;
    for (FleetRobot& robot : robots) {
      if (robot.sent < robot.truth.size()) left.push_back(&robot);
    }
    if (left.empty()) break;
    FleetRobot& next = *left[is_one ? 0 : random.Bits() % left.size()];
    STRATA_RETURN_IF_ERROR(Send(*db, world.scene, sensor, mount, seed * 10000 + scans, next));
    ++scans;
  }
  STRATA_RETURN_IF_ERROR(AwaitIntegrated(*db));
  if (each) STRATA_RETURN_IF_ERROR(PrintSteps(*db, robots));
  STRATA_ASSIGN_OR_RETURN(const JobInfo job, Optimize(*db));
  if (each) STRATA_RETURN_IF_ERROR(PrintSteps(*db, robots));
  STRATA_ASSIGN_OR_RETURN(const Verdicts verdicts, Judge(*db, robots));
  std::printf(
      "%-12s %-4s %-8s seed %-6llu %zu robots %4zu scans %2d x %3d to %2.0f m: %d joined to "
      "%.3f m, %d alone, %d wrong; %s\n",
      name.c_str(),
      frames.c_str(),
      mount.kind.c_str(),
      static_cast<unsigned long long>(seed),
      robots.size(),
      scans,
      sensor.rings,
      sensor.columns,
      sensor.max_range_m,
      verdicts.joined,
      verdicts.off_m,
      verdicts.alone,
      verdicts.wrong,
      job.message.c_str());
  std::fflush(stdout);
  return verdicts;
}

int Main(int argc, char** argv) {
  CLI::App app("Robots of a fleet to each other, in drawn worlds", "fleet");
  std::uint64_t seed = 1;
  int draws = 10;
  std::vector<std::string> worlds = {"campus_loop", "car_park", "bridge", "rooms", "building"};
  std::vector<std::string> frames = {"one", "off", "own", "jump"};
  app.add_option("--seed", seed, "Of the first draw");
  app.add_option("--draws", draws, "Of each world and kind of frames");
  app.add_option("--worlds", worlds, "Of strata-simulate")->delimiter(',');
  std::vector<std::string> mounts = {"level", "tilted", "upright", "handheld", "cone"};
  app.add_option("--frames", frames, "one, off, own, jump")->delimiter(',');
  app.add_option("--mounts", mounts, "level, tilted, upright, handheld, cone")->delimiter(',');
  bool each = false;
  app.add_flag("--each", each, "Every scan's error after the one before it, before and after");
  CLI11_PARSE(app, argc, argv);
  std::map<std::string, Verdicts> all;
  std::size_t drawn = 0;
  for (int d = 0; d < draws; ++d, ++seed) {
    for (const std::string& world : worlds) {
      for (const std::string& kind : frames) {
        Mount mount{mounts.at((drawn++ + static_cast<std::size_t>(d)) % mounts.size())};
        if (mount.kind == "cone") mount.half_view_rad = 0.7;
        const auto verdicts = Draw(world, kind, mount, seed, each);
        if (!verdicts.ok()) {
          std::fprintf(stderr, "%s\n", verdicts.status().ToString().c_str());
          return 2;
        }
        all[kind].joined += verdicts->joined;
        all[kind].alone += verdicts->alone;
        all[kind].wrong += verdicts->wrong;
        all[kind].off_m = std::max(all[kind].off_m, verdicts->off_m);
      }
    }
  }
  bool holds = true;
  for (const auto& [kind, verdicts] : all) {
    std::printf("frames %-4s %4d robots joined to %.3f m, %4d alone, %4d wrong\n",
                kind.c_str(),
                verdicts.joined,
                verdicts.off_m,
                verdicts.alone,
                verdicts.wrong);
    holds = holds && verdicts.wrong == 0;
  }
  std::puts(holds ? "HOLDS: no robot is where nobody said" : "FAILS");
  return holds ? 0 : 1;
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) { return strata::testing::Main(argc, argv); }
