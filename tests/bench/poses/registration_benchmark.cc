// Registering two local maps that start 0.5 m / 3° off, beside PCL's ICP and GICP on 0.25 m voxels:
// processor time with the preparation of both sides and error against the reference, ratios of one
// run.
//
//   registration_benchmark [--pairs 60] [--seed 1] [--ours-only]
//
// Exits 1 where ours ends, in the median, more than half a voxel of PCL's from the reference.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <functional>
#include <iterator>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "core/cloud/sensor_model.h"
#include "core/mls/build.h"
#include "core/registration/mls_registration.h"
#include "tests/bench/poses/registration_peers.h"
#include "tests/bench/poses/simulated_bridge.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"

namespace strata::bench {
namespace {

constexpr double kFarM = 0.125;

struct Pair {
  PointCloud target;
  PointCloud source;
  Pose T_target_source;
};

struct Outcome {
  std::vector<double> milliseconds;
  std::vector<double> error_m;
  std::vector<double> error_rad;
};

double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(q * values.size()))];
}

std::vector<Pair> RecordedPairs(const std::string& folder,
                                const std::string& poses_file,
                                int count) {
  std::vector<Pair> pairs;
  const auto path = testing::FindData(folder);
  if (!path.has_value()) return pairs;
  const auto poses = testing::ReadIndexedPoses(*path / poses_file).value();
  const auto scans = testing::ListScans(*path / "scans");
  const int total = static_cast<int>(scans.size()) - 1;
  const int stride = std::max(1, total / std::max(count, 1));
  auto previous = scans.begin();
  int i = 0;
  for (auto scan = std::next(scans.begin()); scan != scans.end(); previous = scan++, ++i) {
    if (i % stride != 0 || static_cast<int>(pairs.size()) == count) continue;
    Pair pair;
    pair.target = testing::ReadBinaryPcd(previous->second).value();
    pair.source = testing::ReadBinaryPcd(scan->second).value();
    pair.T_target_source =
        poses.at(previous->first).T_world_scan.inverse() * poses.at(scan->first).T_world_scan;
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

std::vector<Pair> BridgePairs(int count) {
  const auto scans = SimulateBridge(count + 1, 7);
  std::vector<Pair> pairs;
  for (std::size_t i = 1; i < scans.size(); ++i) {
    pairs.push_back({scans[i - 1].cloud,
                     scans[i].cloud,
                     scans[i - 1].T_world_scan.inverse() * scans[i].T_world_scan});
  }
  return pairs;
}

// 0.5 m and 3° in random directions.
Pose Perturbation(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const auto direction = [&] {
    return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
  };
  Vector6d step;
  step.head<3>() = 3.0 * std::numbers::pi / 180.0 * direction();
  step.tail<3>() = 0.5 * direction();
  return Retract(Pose::Identity(), step);
}

// Of the whole process: others on the machine do not count, threads of a peer would.
double ProcessorMilliseconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

struct Method {
  std::string name;
  std::function<Pose(const Pair&, const Pose&)> run;
};

Outcome Measure(const Method& method, const std::vector<Pair>& pairs, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Outcome outcome;
  for (const Pair& pair : pairs) {
    const Pose guess = pair.T_target_source * Perturbation(random);
    const double start_ms = ProcessorMilliseconds();
    const Pose T = method.run(pair, guess);
    const double elapsed_ms = ProcessorMilliseconds() - start_ms;
    const Pose error = pair.T_target_source.inverse() * T;
    outcome.milliseconds.push_back(elapsed_ms);
    outcome.error_m.push_back(error.translation().norm());
    outcome.error_rad.push_back(RotationAngleRad(error));
  }
  return outcome;
}

// Whether the first method finds the poses.
bool Compare(const std::string& data,
             const std::vector<Pair>& pairs,
             const std::vector<Method>& methods,
             std::uint64_t seed) {
  if (pairs.empty()) {
    std::printf("%s: no data\n", data.c_str());
    return true;
  }
  std::printf("%s, %zu pairs\n  %-34s %9s %9s %9s %9s %9s %9s\n",
              data.c_str(),
              pairs.size(),
              "",
              "ms med",
              "ms p90",
              "m med",
              "m p90",
              "deg med",
              "x first");
  double first_ms = 0.0;
  double first_m = 0.0;
  for (const Method& method : methods) {
    const Outcome o = Measure(method, pairs, seed);
    const double ms = Quantile(o.milliseconds, 0.5);
    if (first_ms == 0.0) {
      first_ms = ms;
      first_m = Quantile(o.error_m, 0.5);
    }
    std::printf("  %-34s %9.2f %9.2f %9.4f %9.4f %9.4f %9.1f\n",
                method.name.c_str(),
                ms,
                Quantile(o.milliseconds, 0.9),
                Quantile(o.error_m, 0.5),
                Quantile(o.error_m, 0.9),
                Quantile(o.error_rad, 0.5) * 180.0 / std::numbers::pi,
                ms / first_ms);
    std::fflush(stdout);
  }
  return first_m <= kFarM;
}

// From the points of both scans to the pose.
Pose RegisterMaps(const Pair& pair, const Pose& T_guess, const MlsRegistrationOptions& options) {
  MlsScratch scratch;
  const auto features = [&](const PointCloud& cloud, int samples) {
    ScanFeatureOptions feature_options;
    feature_options.sample_count = samples;
    return ScanFeatures::FromMap(
        BuildMlsMap(cloud, Pose::Identity(), SensorModel(), MlsParameters(), scratch)->map,
        feature_options);
  };
  const ScanFeatures source = features(pair.source, options.max_samples);
  const ScanFeatures target_features = features(pair.target, 0);
  const PlacedScan placed[] = {{&target_features, Pose::Identity()}};
  return RegisterScan(source, RegistrationTarget(placed), T_guess, options).T_target_source;
}

Method Ours(const std::string& name, const MlsRegistrationOptions& options) {
  return {name, [options](const Pair& pair, const Pose& T_guess) {
            return RegisterMaps(pair, T_guess, options);
          }};
}

Method Pcl(const std::string& name, Peer peer) {
  return {name, [peer](const Pair& pair, const Pose& T_guess) {
            return RegisterWithPcl(peer, pair.source, pair.target, T_guess);
          }};
}

int Main(int argc, char** argv) {
  CLI::App app("registration of local maps beside PCL");
  int pairs = 60;
  std::uint64_t seed = 1;
  bool ours_only = false;
  app.add_option(
         "--pairs", pairs, "most of one world; of NCLT evenly along the drive (225 are there)")
      ->check(CLI::Range(1, 225));
  app.add_option("--seed", seed, "of the starts");
  app.add_flag("--ours-only", ours_only, "without PCL");
  CLI11_PARSE(app, argc, argv);

  MlsRegistrationOptions thesis;
  thesis.metric = MlsErrorMetric::kPointToPoint;
  thesis.max_samples = 0;
  std::vector<Method> methods = {Ours("class-wise plane-to-plane", {}),
                                 Ours("class-wise point-to-point (thesis)", thesis)};
  if (!ours_only) {
    methods.push_back(Pcl("PCL GICP, 0.25 m voxels", Peer::kGicp));
    methods.push_back(Pcl("PCL ICP, 0.25 m voxels", Peer::kIcp));
  }
  const bool nclt = Compare("nclt_campus_loop",
                            RecordedPairs("nclt_campus_loop", "poses_reference.txt", pairs),
                            methods,
                            seed);
  const bool kitti =
      Compare("kitti_city_drive",
              RecordedPairs("kitti_city_drive", "poses_reference_icp.txt", std::min(pairs, 24)),
              methods,
              seed);
  const bool bridge = Compare("simulated bridge", BridgePairs(std::min(pairs, 26)), methods, seed);
  return nclt && kitti && bridge ? 0 : 1;
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) { return strata::bench::Main(argc, argv); }
