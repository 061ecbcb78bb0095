// Registering two local maps that start 0.5 m / 3° off, beside PCL's ICP and GICP on 0.25 m voxels:
// time with the preparation of both sides and error against the reference, ratios of one run.
//
//   registration_benchmark [--pairs 60] [--seed 1] [--data FOLDER] [--ours-only]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "core/cloud/sensor_model.h"
#include "core/mls/build.h"
#include "core/registration/mls_registration.h"
#include "tests/bench/registration_peers.h"
#include "tests/bench/simulated_bridge.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"

namespace strata::bench {
namespace {

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

std::vector<Pair> RecordedPairs(const std::string& folder, const std::string& poses_file, int count) {
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
    pair.T_target_source = poses.at(previous->first).T_world_scan.inverse() *
                           poses.at(scan->first).T_world_scan;
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

std::vector<Pair> BridgePairs() {
  const auto scans = SimulateBridge(27, 7);
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

struct Method {
  std::string name;
  std::function<Pose(const Pair&, const Pose&)> run;
};

Outcome Measure(const Method& method, const std::vector<Pair>& pairs, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Outcome outcome;
  for (const Pair& pair : pairs) {
    const Pose guess = pair.T_target_source * Perturbation(random);
    const auto start = std::chrono::steady_clock::now();
    const Pose T = method.run(pair, guess);
    const std::chrono::duration<double, std::milli> elapsed =
        std::chrono::steady_clock::now() - start;
    const Pose error = pair.T_target_source.inverse() * T;
    outcome.milliseconds.push_back(elapsed.count());
    outcome.error_m.push_back(error.translation().norm());
    outcome.error_rad.push_back(RotationAngleRad(error));
  }
  return outcome;
}

void Print(const std::string& data, const std::vector<Pair>& pairs, const std::vector<Method>& methods, std::uint64_t seed) {
  if (pairs.empty()) {
    std::printf("%s: no data\n", data.c_str());
    return;
  }
  std::printf("%s, %zu pairs\n  %-34s %9s %9s %9s %9s %9s %8s\n", data.c_str(), pairs.size(), "",
              "ms med", "ms p90", "m med", "m p90", "deg med", "x ours");
  double ours = 0.0;
  for (const Method& method : methods) {
    const Outcome o = Measure(method, pairs, seed);
    const double ms = Quantile(o.milliseconds, 0.5);
    if (ours == 0.0) ours = ms;
    std::printf("  %-34s %9.2f %9.2f %9.4f %9.4f %9.4f %8.1f\n", method.name.c_str(), ms,
                Quantile(o.milliseconds, 0.9), Quantile(o.error_m, 0.5), Quantile(o.error_m, 0.9),
                Quantile(o.error_rad, 0.5) * 180.0 / std::numbers::pi, ms / ours);
    std::fflush(stdout);
  }
}

int Main(int argc, char** argv) {
  CLI::App app("registration of local maps beside PCL");
  int pairs = 60;
  std::uint64_t seed = 1;
  bool ours_only = false;
  app.add_option("--pairs", pairs, "NCLT pairs");
  app.add_option("--seed", seed, "of the starts");
  app.add_flag("--ours-only", ours_only, "without PCL");
  MlsRegistrationOptions options;
  FeatureOptions features;
  MlsParameters mls;
  app.add_option("--normal-sigma", options.normal_sigma_m);
  app.add_option("--tangent-sigma", options.tangent_sigma_m);
  app.add_option("--robust", options.robust_width);
  app.add_option("--gate0", options.initial_gate_m);
  app.add_option("--gate1", options.final_gate_m);
  app.add_option("--factor", options.gate_factor);
  app.add_option("--coarse", options.coarse_samples);
  app.add_option("--samples", options.max_samples);
  app.add_option("--neighbours", options.neighbours);
  app.add_option("--radius", options.neighbour_radius_m);
  app.add_option("--range", features.max_range_m);
  app.add_option("--cell", mls.cell_size_m);
  CLI11_PARSE(app, argc, argv);
  features.sample_count = options.max_samples;
  features.neighbours = options.neighbours;
  features.neighbour_radius_m = options.neighbour_radius_m;

  FeatureOptions target_only = features;
  target_only.sample_count = 0;
  double feat_ms = 0, target_ms = 0, reg_ms = 0; int its=0, n=0; double nf=0;
  const auto now = [] { return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count(); };
  MlsScratch scratch;
  const auto build = [&](const PointCloud& c) { return BuildMlsMap(c, Pose::Identity(), SensorModel(), mls, scratch).value().map; };
  const auto ours = [&](const Pair& pair, const Pose& guess, const MlsRegistrationOptions& o) {
    double t0 = now();
    const ScanFeatures source = ScanFeatures::FromMap(build(pair.source), features);
    const ScanFeatures target_features = ScanFeatures::FromMap(build(pair.target), target_only);
    double t1 = now();
    const PlacedScan placed[] = {{&target_features, Pose::Identity()}};
    const RegistrationTarget target(placed);
    double t2 = now();
    const auto r = RegisterScan(source, target, guess, o);
    double t3 = now();
    feat_ms += t1 - t0; target_ms += t2 - t1; reg_ms += t3 - t2; its += r.iterations; ++n; nf += source.size();
    return r.T_target_source;
  };
  MlsRegistrationOptions thesis = options;
  thesis.metric = MlsErrorMetric::kPointToPoint;
  thesis.max_samples = 0;
  std::vector<Method> methods = {
      {"class-wise plane-to-plane", [&](const Pair& p, const Pose& g) { return ours(p, g, options); }}};
  if (!ours_only) {
    methods.push_back({"class-wise point-to-point (thesis)", [&](const Pair& p, const Pose& g) { return ours(p, g, thesis); }});
    methods.push_back({"PCL GICP, 0.25 m voxels", [](const Pair& p, const Pose& g) {
                         return RegisterWithPcl(Peer::kGicp, p.source, p.target, g);
                       }});
    methods.push_back({"PCL ICP, 0.25 m voxels", [](const Pair& p, const Pose& g) {
                         return RegisterWithPcl(Peer::kIcp, p.source, p.target, g);
                       }});
  }
  auto run = [&](const char* name, const std::vector<Pair>& ps) {
    feat_ms = target_ms = reg_ms = 0; its = n = 0; nf = 0;
    Print(name, ps, methods, seed);
    if (ours_only && n) std::printf("    features %.2f target %.2f register %.2f ms; iterations %.1f features %.0f\n", feat_ms / n, target_ms / n, reg_ms / n, double(its) / n, nf / n);
  };
  run("nclt_campus_loop", RecordedPairs("nclt_campus_loop", "poses_reference.txt", pairs));
  run("kitti_city_drive", RecordedPairs("kitti_city_drive", "poses_reference_icp.txt", 24));
  run("simulated bridge", BridgePairs());
  return 0;
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) { return strata::bench::Main(argc, argv); }
