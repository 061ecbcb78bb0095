// Places the scans of a recording one after another as ingest does: predicted by the last corrected
// pose and the uploaded relative motion, matched to the nearest scans in place. Prints how far the
// result is from the reference, and writes it as TUM for tools/ate.py.
//
//   ingest_chain [--only NAME] [--out FOLDER] [--neighbours 15] [--radius 25] …
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"
#include <CLI/CLI.hpp>

#include "core/cloud/sensor_model.h"
#include "core/mls/build.h"
#include "core/registration/mls_registration.h"
#include "core/registration/neighbours.h"
#include "core/registration/umeyama.h"
#include "core/registration/upright_frame.h"
#include "core/registration/upright_offsets.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"

namespace strata {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

struct Settings {
  MlsParameters mls;
  ScanFeatureOptions features;
  TargetOptions target;
  NeighbourPolicy policy;
  MlsRegistrationOptions registration;
  bool from_reference = false;
  bool verbose = false;
  std::string out;
};

struct Recording {
  std::string name;
  std::vector<int> index;
  std::vector<PointCloud> clouds;
  std::vector<Pose> uploaded;
  std::vector<Pose> reference;
};

Recording Load(const std::filesystem::path& folder,
               const std::string& uploaded_file,
               const std::string& reference_file) {
  Recording r;
  r.name = folder.filename().string();
  const auto uploaded = testing::ReadIndexedPoses(folder / uploaded_file).value();
  const auto reference = testing::ReadIndexedPoses(folder / reference_file).value();
  for (const auto& [index, path] : testing::ListScans(folder / "scans")) {
    r.index.push_back(index);
    r.clouds.push_back(testing::ReadBinaryPcd(path).value());
    r.uploaded.push_back(uploaded.at(index).T_world_scan);
    r.reference.push_back(reference.at(index).T_world_scan);
  }
  return r;
}

// Noise of σ 0.05 m and 0.5° on every step, accumulated.
std::vector<Pose> WithStepNoise(const std::vector<Pose>& poses, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Pose> noisy = {poses[0]};
  for (std::size_t i = 1; i < poses.size(); ++i) {
    Vector6d step;
    for (int k = 0; k < 3; ++k) step[k] = normal(random) * 0.5 / kDegrees;
    for (int k = 3; k < 6; ++k) step[k] = normal(random) * 0.05;
    noisy.push_back(noisy.back() * Retract(poses[i - 1].inverse() * poses[i], step));
  }
  return noisy;
}

double AbsoluteTrajectoryError(const std::vector<Pose>& poses, const std::vector<Pose>& reference) {
  std::vector<Eigen::Vector3d> x;
  std::vector<Eigen::Vector3d> y;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    x.push_back(poses[i].translation());
    y.push_back(reference[i].translation());
  }
  return FitRigidTransform(x, y).rms_m;
}

// Median, 90th percentile and largest.
std::string Spread(std::vector<double> errors_m) {
  if (errors_m.empty()) return "";
  std::ranges::sort(errors_m);
  return absl::StrFormat("steps %.3f / %.3f / %.3f m",
                         errors_m[errors_m.size() / 2],
                         errors_m[errors_m.size() * 9 / 10],
                         errors_m.back());
}

void WriteTum(const std::filesystem::path& path, const std::vector<Pose>& poses) {
  std::ofstream out(path);
  out.precision(12);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Quaterniond q(poses[i].linear());
    out << i << ' ' << poses[i].translation().transpose() << ' ' << q.coeffs().transpose() << '\n';
  }
}

std::vector<Pose> Place(const Recording& recording, const Settings& settings) {
  MlsScratch scratch;
  std::vector<ScanFeatures> features;
  std::vector<Pose> poses;
  std::map<Termination, int> outcomes;
  std::vector<double> step_errors_m;
  double features_ms = 0.0;
  double target_ms = 0.0;
  double register_ms = 0.0;
  double worst_overlap = 1.0;
  const auto now = [] {
    return std::chrono::duration<double, std::milli>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
  };
  for (std::size_t i = 0; i < recording.clouds.size(); ++i) {
    const double start = now();
    const PointCloud& cloud = recording.clouds[i];
    ScanFeatureOptions options = settings.features;
    options.up = BelievedUp(cloud.points, UpOf(recording.uploaded[i]));
    options.R_map_scan = UprightTurn(options.up);
    const MlsMap map =
        BuildMlsMap(cloud, Pose(options.R_map_scan), SensorModel(), settings.mls, scratch)
            .value()
            .map;
    UprightOffsets offsets(map, options.samples_per_metre, options.R_map_scan);
    offsets.Add(cloud.points);
    features.push_back(ScanFeatures::FromMap(map, options, &offsets));
    features_ms += now() - start;
    if (i == 0) {
      poses.push_back(recording.uploaded[0]);
      continue;
    }
    const Pose guess = settings.from_reference
                           ? recording.reference[i]
                           : Normalized(poses.back() * recording.uploaded[i - 1].inverse() *
                                        recording.uploaded[i]);
    const double target_start = now();
    std::vector<PlacedScan> placed;
    for (const std::size_t j : SelectNeighbours(poses, guess, settings.policy)) {
      placed.push_back({&features[j], poses[j]});
    }
    TargetOptions target_options = settings.target;
    target_options.centre = guess.translation();
    const RegistrationTarget target(placed, target_options);
    target_ms += now() - target_start;
    const double register_start = now();
    const RegistrationResult r =
        RegisterScan(features.back(), target, guess, settings.registration);
    register_ms += now() - register_start;
    ++outcomes[r.termination];
    const bool accepted = r.termination == Termination::kConverged ||
                          r.termination == Termination::kMaxIterations ||
                          r.termination == Termination::kDegenerate;
    poses.push_back(accepted ? r.T_target_source : guess);
    step_errors_m.push_back((recording.reference[i].inverse() * recording.reference[i - 1] *
                             poses[i - 1].inverse() * poses[i])
                                .translation()
                                .norm());
    if (settings.from_reference) poses.back() = recording.reference[i];
    worst_overlap = std::min(worst_overlap, r.overlap);
    if (settings.verbose) {
      const Pose moved = guess.inverse() * r.T_target_source;
      std::printf(
          "%6d %-18s scans %zu it %d overlap %.2f rms %.3f moved %.3f m (%.3f %.3f %.3f) %.3f deg, "
          "ref %.3f m %.3f "
          "deg\n",
          recording.index[i],
          std::string(ToString(r.termination)).c_str(),
          placed.size(),
          r.iterations,
          r.overlap,
          r.rms_m,
          moved.translation().norm(),
          moved.translation().x(),
          moved.translation().y(),
          moved.translation().z(),
          RotationAngleRad(moved) * kDegrees,
          (recording.reference[i - 1].inverse() * recording.reference[i] *
           (poses[i - 1].inverse() * poses[i]).inverse())
              .translation()
              .norm(),
          RotationAngleRad((poses[i - 1].inverse() * poses[i]).inverse() *
                           recording.reference[i - 1].inverse() * recording.reference[i]) *
              kDegrees);
    }
  }
  const double n = static_cast<double>(recording.clouds.size());
  std::printf(
      "%-18s ATE %.4f m (uploaded %.4f m); features %.1f target %.1f register %.1f ms a scan; "
      "least overlap %.2f; %s;",
      recording.name.c_str(),
      AbsoluteTrajectoryError(poses, recording.reference),
      AbsoluteTrajectoryError(recording.uploaded, recording.reference),
      features_ms / n,
      target_ms / n,
      register_ms / n,
      worst_overlap,
      Spread(step_errors_m).c_str());
  for (const auto& [termination, count] : outcomes) {
    std::printf(" %s %d", std::string(ToString(termination)).c_str(), count);
  }
  std::printf("\n");
  std::fflush(stdout);
  if (!settings.out.empty()) {
    WriteTum(std::filesystem::path(settings.out) / (recording.name + ".tum"), poses);
    WriteTum(std::filesystem::path(settings.out) / (recording.name + "_reference.tum"),
             recording.reference);
  }
  return poses;
}

// Of scan 900 relative to scan 0, against the verified loop edge.
void PrintClosure(const std::vector<Pose>& poses, const std::filesystem::path& file) {
  std::ifstream in(file);
  Pose T_900_0 = Pose::Identity();
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) in >> T_900_0.matrix()(row, column);
  }
  const Pose error = poses.back().inverse() * poses.front() * T_900_0.inverse();
  const Eigen::Vector3d t = error.translation();
  std::printf("%-18s closure %.3f m (%.3f %.3f %.3f) %.3f deg\n",
              "",
              t.norm(),
              t.x(),
              t.y(),
              t.z(),
              RotationAngleRad(error) * kDegrees);
}

int Main(int argc, char** argv) {
  CLI::App app("chains of registrations as ingest makes them");
  Settings settings;
  std::string only;
  std::vector<std::string> folders;
  app.add_option("folders",
                 folders,
                 "recordings (scans/, poses_initial.txt, poses_reference.txt); without, those of "
                 "STRATA_DATA");
  app.add_flag("--from-reference",
               settings.from_reference,
               "match each scan from where the reference has it to scans that are there, too");
  app.add_option("--only", only, "one recording");
  app.add_option("--out", settings.out, "folder for TUM files");
  app.add_flag("--verbose", settings.verbose, "a line a scan");
  app.add_option("--neighbours", settings.policy.max_scans);
  app.add_option("--radius", settings.policy.radius_m);
  app.add_option("--cell", settings.mls.cell_size_m);
  app.add_option("--samples", settings.registration.max_samples);
  app.add_option("--coarse", settings.registration.coarse_samples);
  app.add_option("--gate0", settings.registration.initial_gate_m);
  app.add_option("--gate1", settings.registration.final_gate_m);
  app.add_option("--factor", settings.registration.gate_factor);
  app.add_option("--robust", settings.registration.robust_width);
  app.add_option("--normal-sigma", settings.registration.normal_sigma_m);
  app.add_option("--tangent-sigma", settings.registration.tangent_sigma_m);
  app.add_option("--min-hold", settings.registration.min_hold);
  app.add_option("--guess-sigma-m", settings.registration.guess_sigma_m);
  app.add_option("--guess-sigma-rad", settings.registration.guess_sigma_rad);
  app.add_option("--min-overlap", settings.registration.min_overlap);
  app.add_option("--seed", settings.features.seed);
  app.add_option("--neighbour-count", settings.registration.neighbours);
  app.add_option("--neighbour-radius", settings.registration.neighbour_radius_m);
  app.add_option("--thinning", settings.target.thinning_m);
  app.add_option("--range", settings.features.max_range_m);
  CLI11_PARSE(app, argc, argv);
  settings.features.sample_count = settings.registration.max_samples;
  settings.features.neighbours = settings.registration.neighbours;

  for (const std::string& folder : folders) {
    Place(Load(folder, "poses_initial.txt", "poses_reference.txt"), settings);
  }
  if (!folders.empty()) return 0;
  const auto wanted = [&](const std::string& name) { return only.empty() || only == name; };
  if (const auto f = testing::FindData("kitti_city_drive");
      f.has_value() && wanted("kitti_city_drive")) {
    Recording r = Load(*f, "poses_reference_icp.txt", "poses_reference_icp.txt");
    for (const std::uint64_t seed : {1, 2, 3}) {
      r.uploaded = WithStepNoise(r.reference, seed);
      Place(r, settings);
    }
  }
  for (const std::string name : {"hall_livox_loop", "eth_facade_tls"}) {
    if (const auto f = testing::FindData(name); f.has_value() && wanted(name)) {
      Place(Load(*f, "poses_initial.txt", "poses_reference.txt"), settings);
    }
  }
  if (const auto f = testing::FindData("nclt_campus_loop");
      f.has_value() && wanted("nclt_campus_loop")) {
    PrintClosure(Place(Load(*f, "poses_initial.txt", "poses_reference.txt"), settings),
                 *f / "loop_edge_0_900.txt");
  }
  return 0;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }
