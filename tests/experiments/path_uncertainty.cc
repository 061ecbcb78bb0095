// Is what the pose graph says of its own uncertainty along the way true? Closures are looked for as
// far away, and believed as far off, as it says.
//
//   path_uncertainty [--seed 1] [--draws 5] [--worlds campus_loop,car_park,bridge,rooms,building]
//
// A robot drives through a drawn world once, with noise of odometry, a drawn sensor and 1 to 3 m
// from scan to scan; so did one through a recorded campus (nclt where the data are: all scans, then
// every second). Ingest aligns the scans and no loop is closed. Between scans of the way the
// error of the relative pose is held against the σ of core/posegraph/closures/path_uncertainty.h,
// by the length of the way between them: NEES is the mean of error² / σ², which honest σ make 1 (σ²
// is the trace of the covariance); "beyond" is the share of errors above 3 σ.
// Bounds: σ has to cover recordings that drift more than these do, so it may be too large, not too
// small: NEES at most 1 and at most 1 % beyond 3 σ, for every length and in every world. Exits 1
// where one does not hold.
#include "core/posegraph/closures/path_uncertainty.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <CLI/CLI.hpp>

#include "core/api/database.h"
#include "core/common/cache_budget.h"
#include "core/common/status.h"
#include "core/engine/consistency/graph_world.h"
#include "core/engine/consistency/optimize_settings.h"
#include "core/engine/engine.h"
#include "core/engine/map/map_core.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/temp_dir.h"

namespace strata::testing {
namespace {

constexpr char kMap[] = "map";
constexpr std::array<double, 4> kWaysM = {10.0, 40.0, 100.0, 1e9};  // ends of the classes
constexpr double kMostNees = 1.0;
constexpr double kMostBeyond = 0.01;

World WorldOf(const std::string& name, std::uint64_t seed) {
  if (name == "car_park") return CarParkWorld();
  if (name == "rooms") return RoomsWorld(0.1, seed);
  if (name == "building") return BuildingWorld(seed);
  if (name == "bridge") return BridgeWorld();
  return CampusLoopWorld(seed);
}

struct Errors {
  std::size_t pairs = 0;
  double sum_m = 0.0, sum_rad = 0.0;  // of error² / σ²
  std::size_t beyond = 0;             // one of both above 3 σ

  void Add(const Errors& more) {
    pairs += more.pairs;
    sum_m += more.sum_m;
    sum_rad += more.sum_rad;
    beyond += more.beyond;
  }
  double Mean(double sum) const { return sum / static_cast<double>(pairs); }
  bool Hold() const {
    return pairs == 0 || (Mean(sum_m) <= kMostNees && Mean(sum_rad) <= kMostNees &&
                          Mean(static_cast<double>(beyond)) <= kMostBeyond);
  }
};
using ByWay = std::array<Errors, kWaysM.size()>;

// A drive before it is uploaded.
struct Seen {
  std::vector<Pose> truth;
  std::vector<Pose> said;
  std::function<absl::StatusOr<PointCloud>(std::size_t)> cloud;
};

Seen Drawn(const World& world, Random& random) {
  const Robot& driver = world.loops.empty() ? world.robots.front() : world.loops.front();
  const double step_m = random.Uniform(1.0, 3.0);
  SensorOptions sensor;
  sensor.rings = random.Bits() % 2 == 0 ? 32 : 48;
  sensor.columns = 360;
  sensor.max_range_m = random.Uniform(20.0, 60.0);
  Seen seen;
  seen.truth = Drive(world.scene, driver.waypoints, step_m, 1.2);
  seen.said = NoisyOdometry(seen.truth, OdometryNoise(), random.Bits());
  seen.cloud = [&world, sensor, way = seen.truth, seed = random.Bits()](std::size_t k) {
    return SimulateScan(world.scene, sensor, way[k], seed + k);
  };
  return seen;
}

// Every `every`-th scan.
absl::StatusOr<Seen> Recorded(const std::filesystem::path& folder, std::size_t every) {
  STRATA_ASSIGN_OR_RETURN(const auto said, ReadIndexedPoses(folder / "poses_initial.txt"));
  STRATA_ASSIGN_OR_RETURN(const auto truth, ReadIndexedPoses(folder / "poses_reference.txt"));
  Seen seen;
  std::vector<std::filesystem::path> files;
  std::size_t k = 0;
  for (const auto& [index, file] : ListScans(folder / "scans")) {
    if (k++ % every != 0 || !said.contains(index) || !truth.contains(index)) continue;
    seen.said.push_back(said.at(index).T_world_scan);
    seen.truth.push_back(truth.at(index).T_world_scan);
    files.push_back(file);
  }
  seen.cloud = [files](std::size_t scan) { return ReadBinaryPcd(files[scan]); };
  return seen;
}

absl::Status Upload(api::Database& db, const Seen& seen) {
  STRATA_RETURN_IF_ERROR(db.maps().Create({}, kMap, {}).status());
  for (std::size_t k = 0; k < seen.truth.size(); ++k) {
    STRATA_ASSIGN_OR_RETURN(const PointCloud cloud, seen.cloud(k));
    ScanHeader header;
    header.id = {"robot", k + 1};
    header.T_map_scan = seen.said[k];
    header.point_count = cloud.size();
    STRATA_ASSIGN_OR_RETURN(const auto upload, db.scans().Upload({}, kMap, header));
    STRATA_RETURN_IF_ERROR(upload->Write(cloud));
    STRATA_RETURN_IF_ERROR(upload->Finish().status());
  }
  while (true) {
    STRATA_ASSIGN_OR_RETURN(const MapStats stats, db.maps().Stats({}, kMap));
    if (stats.scans_pending == 0) return absl::OkStatus();
    absl::SleepFor(absl::Milliseconds(10));
  }
}

absl::StatusOr<ByWay> Judge(const EngineOptions& options, const std::vector<Pose>& way) {
  STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<MapCore> core,
                          MapCore::Open(kMap,
                                        options.directory / (std::string(kMap) + ".strata"),
                                        options,
                                        std::make_shared<CacheBudget>(1 << 20)));
  const absl::StatusOr<GraphWorld> world = GraphWorld::Read(*core);
  core->Close();
  STRATA_RETURN_IF_ERROR(world.status());
  const std::vector<Pose>& poses = world->Poses();
  const MeasuredGraph measured = world->Measured(DefaultOptimizeSettings());
  const PathUncertainties known(poses, measured.edges);
  ByWay errors;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::vector<PathUncertainty> from_i = known.From(i);
    for (std::size_t j = i + 1; j < poses.size(); ++j) {
      const PathUncertainty& u = from_i[j];
      if (!u.connected) continue;
      const Pose T_i_j = way[world->id(i).sequence - 1].inverse() * way[world->id(j).sequence - 1];
      const Pose error = T_i_j.inverse() * (poses[i].inverse() * poses[j]);
      std::size_t k = 0;
      while (u.way_m > kWaysM.at(k)) ++k;
      const double m = error.translation().norm() / u.sigma_m;
      const double rad = RotationAngleRad(error) / u.sigma_rad;
      errors.at(k).Add({1, m * m, rad * rad, m > 3.0 || rad > 3.0 ? 1U : 0U});
    }
  }
  return errors;
}

absl::StatusOr<ByWay> ErrorsOf(const Seen& seen) {
  const TempDir directory;
  EngineOptions options;
  options.directory = directory.path();
  {
    STRATA_ASSIGN_OR_RETURN(const std::unique_ptr<api::Database> db, OpenEngine(options));
    STRATA_RETURN_IF_ERROR(Upload(*db, seen));
  }
  return Judge(options, seen.truth);
}

absl::StatusOr<ByWay> Draws(const std::string& name, std::uint64_t seed, int draws) {
  ByWay all;
  for (int d = 0; d < draws; ++d, ++seed) {
    Random random(seed);
    const World world = WorldOf(name, seed);
    STRATA_ASSIGN_OR_RETURN(const ByWay errors, ErrorsOf(Drawn(world, random)));
    for (std::size_t k = 0; k < all.size(); ++k) all.at(k).Add(errors.at(k));
  }
  return all;
}

bool Print(const std::string& name, const ByWay& errors) {
  bool holds = true;
  double from_m = 0.0;
  for (std::size_t k = 0; k < errors.size(); ++k) {
    const Errors& e = errors.at(k);
    if (e.pairs > 0) {
      std::printf("| %s | %.0f | %zu | %.3f | %.3f | %.2f %% |\n",
                  name.c_str(),
                  from_m,
                  e.pairs,
                  e.Mean(e.sum_m),
                  e.Mean(e.sum_rad),
                  100.0 * e.Mean(static_cast<double>(e.beyond)));
    }
    holds = holds && e.Hold();
    from_m = kWaysM.at(k);
  }
  std::fflush(stdout);
  return holds;
}

absl::StatusOr<bool> Run(std::uint64_t seed, int draws, const std::vector<std::string>& worlds) {
  std::printf("%d drives through each world, from seed %llu\n",
              draws,
              static_cast<unsigned long long>(seed));
  std::puts("| world | way from [m] | pairs | NEES position | NEES rotation | beyond 3 σ |");
  std::puts("|---|---|---|---|---|---|");
  bool holds = true;
  for (const std::string& world : worlds) {
    STRATA_ASSIGN_OR_RETURN(const ByWay errors, Draws(world, seed, draws));
    holds = Print(world, errors) && holds;
  }
  const auto folder = FindData("nclt_campus_loop");
  for (std::size_t every = 1; every <= 2 && folder.has_value(); ++every) {
    STRATA_ASSIGN_OR_RETURN(const Seen seen, Recorded(*folder, every));
    STRATA_ASSIGN_OR_RETURN(const ByWay errors, ErrorsOf(seen));
    holds = Print(every == 1 ? "nclt" : "nclt, every second", errors) && holds;
  }
  return holds;
}

int Main(int argc, char** argv) {
  CLI::App app("The pose graph's uncertainty along the way against planted truth",
               "path_uncertainty");
  std::uint64_t seed = 1;
  int draws = 5;
  std::vector<std::string> worlds = {"campus_loop", "car_park", "bridge", "rooms", "building"};
  app.add_option("--seed", seed, "Of the first draw");
  app.add_option("--draws", draws, "Of each world");
  app.add_option("--worlds", worlds, "Of strata-simulate")->delimiter(',');
  CLI11_PARSE(app, argc, argv);
  const absl::StatusOr<bool> holds = Run(seed, draws, worlds);
  if (!holds.ok()) {
    std::fprintf(stderr, "%s\n", holds.status().ToString().c_str());
    return 2;
  }
  std::puts(*holds ? "HOLDS: nothing is surer than it is true" : "FAILS");
  return *holds ? 0 : 1;
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) { return strata::testing::Main(argc, argv); }
