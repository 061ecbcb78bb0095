// Which scans show the same place? Three tables over recorded loops and simulated ones, against the
// true poses. Scans less than 30 m of way apart are not asked about.
//   descriptor    pairs sorted by the distance of their descriptors: how many of the true ones come
//                 before the first false one, and whether heading and nearest place are right
//   localisation  every scan without any prior: its five likest places are verified, and one of
//                 them is the answer or there is none
//   closures      candidates from the uploaded poses (NCLT's are 18 m off at the closure, simulated
//                 ones have noisy odometry), verified, then checked for consistency
//
//   place_recognition [--only NAME] [--table descriptor|localisation|closures] [--verbose]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "core/cloud/sensor_model.h"
#include "core/mls/build.h"
#include "core/posegraph/closures/closure_candidates.h"
#include "core/posegraph/closures/closure_consistency.h"
#include "core/registration/place_descriptor.h"
#include "core/registration/place_index.h"
#include "core/registration/place_match.h"
#include "core/registration/upright_frame.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"

namespace strata {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kApartOnWayM = 30.0;

struct Settings {
  std::string only;
  std::string table;
  bool verbose = false;
  std::size_t beside = 2;         // neighbours to each side that a scan is matched to with it
  double simulated_step_m = 2.0;  // between scans
  testing::OdometryNoise noise;
  DriftOptions drift{0.1, 0.01};
};

struct Recording {
  std::string name;
  std::vector<PointCloud> clouds;
  std::vector<Pose> uploaded;
  std::vector<Pose> reference;
};

// What is kept of the scans.
struct Places {
  std::string name;
  std::vector<Pose> uploaded;
  std::vector<Pose> reference;
  std::vector<double> way;
  std::vector<PlaceDescriptor> descriptors;
  std::vector<ScanFeatures> features;

  std::size_t size() const { return way.size(); }
  double Apart(std::size_t i, std::size_t j) const {
    return (reference[i].translation() - reference[j].translation()).norm();
  }
  bool FarOnWay(std::size_t i, std::size_t j) const {
    return std::abs(way[j] - way[i]) > kApartOnWayM;
  }
};

double MillisecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

Recording Load(const std::filesystem::path& folder) {
  Recording r;
  r.name = folder.filename().string();
  const auto uploaded = testing::ReadIndexedPoses(folder / "poses_initial.txt").value();
  const auto reference = testing::ReadIndexedPoses(folder / "poses_reference.txt").value();
  for (const auto& [index, path] : testing::ListScans(folder / "scans")) {
    r.clouds.push_back(testing::ReadBinaryPcd(path).value());
    r.uploaded.push_back(uploaded.at(index).T_world_scan);
    r.reference.push_back(reference.at(index).T_world_scan);
  }
  return r;
}

Recording Simulate(const std::string& name,
                   const testing::World& world,
                   const std::vector<testing::Robot>& robots,
                   const Settings& settings) {
  Recording r;
  r.name = name;
  std::vector<Eigen::Vector3d> waypoints;  // one robot drives all of them
  for (const testing::Robot& robot : robots) {
    waypoints.insert(waypoints.end(), robot.waypoints.begin(), robot.waypoints.end());
  }
  r.reference = testing::Drive(world.scene, waypoints, settings.simulated_step_m, 1.2);
  r.uploaded = testing::NoisyOdometry(r.reference, settings.noise, 1);
  testing::SensorOptions sensor;
  sensor.columns = 480;
  for (std::size_t i = 0; i < r.reference.size(); ++i) {
    r.clouds.push_back(testing::SimulateScan(world.scene, sensor, r.reference[i], i + 1));
  }
  return r;
}

Places Describe(const Recording& r) {
  Places places;
  places.name = r.name;
  places.uploaded = r.uploaded;
  places.reference = r.reference;
  double ms = 0.0;
  for (std::size_t i = 0; i < r.clouds.size(); ++i) {
    const MlsMap map =
        BuildMlsMap(r.clouds[i], Pose::Identity(), SensorModel(), MlsParameters())->map;
    const auto start = std::chrono::steady_clock::now();
    places.descriptors.push_back(DescribePlace(map));
    ms += MillisecondsSince(start);
    places.features.push_back(ScanFeatures::FromMap(map));
    places.way.push_back(0.0);
    if (i > 0) places.way[i] = places.way[i - 1] + places.Apart(i, i - 1);
  }
  std::printf("%s: %zu scans, %.0f m, %.1f ms a descriptor\n",
              r.name.c_str(),
              places.size(),
              places.way.back(),
              ms / static_cast<double>(places.size()));
  return places;
}

double HeadingRad(const Pose& T) { return std::atan2(T.linear()(1, 0), T.linear()(0, 0)); }

struct Pair {
  std::size_t i, j;
  PlaceSimilarity similarity;
};

std::vector<Pair> ComparedPairs(const Places& places) {
  std::vector<Pair> pairs;
  for (std::size_t j = 0; j < places.size(); ++j) {
    for (std::size_t i = 0; i < j && places.FarOnWay(i, j); ++i) {
      pairs.push_back({i, j, ComparePlaces(places.descriptors[i], places.descriptors[j])});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return a.similarity.distance < b.similarity.distance;
  });
  return pairs;
}

void PrintDescriptorTable(const Places& places) {
  const std::vector<Pair> pairs = ComparedPairs(places);
  for (const double radius : {5.0, 12.0}) {
    int all = 0;
    int before_false = 0;
    int right_heading = 0;
    bool any_false = false;
    std::vector<int> nearest(places.size(), -1);  // whether the likest place is a true one
    std::vector<bool> has_true(places.size(), false);
    for (const Pair& p : pairs) {
      const double apart = places.Apart(p.i, p.j);
      const bool is_true = apart < radius;
      any_false = any_false || apart > 12.0;
      if (nearest[p.j] < 0) nearest[p.j] = static_cast<int>(is_true);
      if (!is_true) continue;
      has_true[p.j] = true;
      ++all;
      before_false += static_cast<int>(!any_false);
      const double yaw = HeadingRad(places.reference[p.i].inverse() * places.reference[p.j]);
      const double error = std::remainder(yaw - p.similarity.heading_rad, std::numbers::pi);
      right_heading += static_cast<int>(std::abs(error) < 0.09);
    }
    int queries = 0;
    int first = 0;
    for (std::size_t j = 0; j < places.size(); ++j) {
      if (!has_true[j]) continue;
      ++queries;
      first += nearest[j];
    }
    std::printf(
        "  descriptor, within %2.0f m: %d pairs, %d before the first false one, heading right "
        "(5 deg) of %d; likest place right for %d of %d scans\n",
        radius,
        all,
        before_false,
        right_heading,
        first,
        queries);
  }
}

// Scan i and its neighbours, in a frame in which the scans have the poses `T`.
std::vector<SeenScan> TargetOf(const Places& places,
                               const std::vector<Pose>& T,
                               const Pose& T_target_map,
                               std::size_t i,
                               std::size_t beside) {
  std::vector<SeenScan> target;
  for (std::size_t k = i - std::min(i, beside); k <= std::min(i + beside, places.size() - 1); ++k) {
    target.push_back({&places.features[k], Normalized(T_target_map * T[k])});
  }
  return target;
}

bool IsRight(const Pose& truth, const Pose& T) {
  const Pose error = truth.inverse() * T;
  return error.translation().norm() < 0.5 && RotationAngleRad(error) < 0.05;
}

void PrintMatch(
    const char* what, std::size_t i, std::size_t j, const PlaceMatch& m, const Pose& truth) {
  const Pose error = truth.inverse() * m.T_target_source;
  std::printf(
      "    %s %zu-%zu %s: overlap %.2f against %.3f rival %.2f hold %.4f confidence %.2f, off by "
      "%.2f m %.1f deg\n",
      what,
      i,
      j,
      std::string(ToString(m.verdict)).c_str(),
      m.overlap,
      m.contradiction,
      m.rival,
      m.hold,
      m.confidence,
      error.translation().norm(),
      RotationAngleRad(error) * kDegrees);
}

void PrintLocalisationTable(const Places& places, const Settings& settings) {
  PlaceIndex index;
  for (std::size_t i = 0; i < places.size(); ++i) index.Add(i, places.descriptors[i]);
  int seen_before = 0;
  int right = 0;
  int wrong = 0;
  const auto start = std::chrono::steady_clock::now();
  for (std::size_t j = 0; j < places.size(); ++j) {
    const auto excluded = [&](std::uint64_t i) { return !places.FarOnWay(i, j); };
    bool is_known = false;
    for (std::size_t i = 0; i < places.size(); ++i) {
      is_known = is_known || (!excluded(i) && places.Apart(i, j) < 12.0);
    }
    seen_before += static_cast<int>(is_known);
    std::vector<PlaceMatch> matches;
    for (const auto& near : index.Nearest(places.descriptors[j], 5, excluded)) {
      const std::vector<SeenScan> target =
          TargetOf(places, places.reference, Pose::Identity(), near.number, settings.beside);
      matches.push_back(MatchPlace({.features = &places.features[j]},
                                   target,
                                   HypothesesOf(near.similarity,
                                                UprightTurn(places.features[near.number].up()),
                                                UprightTurn(places.features[j].up()))));
      if (settings.verbose) {
        PrintMatch("at", near.number, j, matches.back(), places.reference[j]);
      }
    }
    const std::optional<std::size_t> answer = UniquePlace(matches);
    if (!answer.has_value()) continue;
    ++(IsRight(places.reference[j], matches[*answer].T_target_source) ? right : wrong);
  }
  std::printf(
      "  localisation: %d of %zu scans within 12 m of others; right %d, wrong %d; %.0f ms "
      "each\n",
      seen_before,
      places.size(),
      right,
      wrong,
      MillisecondsSince(start) / static_cast<double>(places.size()));
}

std::vector<ClosureCandidate> CandidatesOf(const Places& places,
                                           const std::vector<GraphEdge>& edges,
                                           const DriftOptions& drift) {
  std::vector<ClosureNode> nodes;
  PlaceIndex index;
  std::vector<AlikePair> alike;
  for (std::size_t j = 0; j < places.size(); ++j) {
    nodes.push_back({places.uploaded[j], 1});
    const auto excluded = [&](std::uint64_t i) { return !places.FarOnWay(i, j); };
    for (const auto& near : index.Nearest(places.descriptors[j], 4, excluded)) {
      alike.push_back({static_cast<std::size_t>(near.number), j, near.similarity});
    }
    index.Add(j, places.descriptors[j]);
  }
  ClosureCandidateOptions options;
  options.drift = drift;
  return FindClosureCandidates(nodes, edges, alike, options).value();
}

void PrintClosureTable(const Places& places, const Settings& settings) {
  std::vector<GraphEdge> edges;
  for (std::size_t j = 1; j < places.size(); ++j) {
    edges.push_back({j - 1, j, 1e4 * Matrix6d::Identity()});
  }
  const std::vector<ClosureCandidate> candidates = CandidatesOf(places, edges, settings.drift);
  std::vector<Closure> closures;
  std::vector<bool> right;
  int near = 0;
  const auto start = std::chrono::steady_clock::now();
  for (const ClosureCandidate& c : candidates) {
    near += static_cast<int>(places.Apart(c.i, c.j) < 12.0);
    const std::vector<SeenScan> target =
        TargetOf(places, places.uploaded, places.uploaded[c.i].inverse(), c.i, settings.beside);
    const PlaceMatch m = MatchPlace({&places.features[c.j]}, target, c.hypotheses);
    const Pose truth = places.reference[c.i].inverse() * places.reference[c.j];
    if (settings.verbose) {
      PrintMatch(c.reason == ClosureReason::kNear ? "near" : "alike", c.i, c.j, m, truth);
    }
    if (!m.matched()) continue;
    closures.push_back({c.i, c.j, m.T_target_source, 0.2, 0.02});
    right.push_back(IsRight(truth, m.T_target_source));
  }
  const double match_ms =
      MillisecondsSince(start) / std::max(1.0, static_cast<double>(candidates.size()));
  ClosureConsistencyOptions consistency;
  consistency.drift = settings.drift;
  const auto set = ConsistentClosures(places.uploaded, edges, closures, consistency).value();
  const auto kept_right = std::count_if(
      set.kept.begin(), set.kept.end(), [&](std::size_t k) { return static_cast<bool>(right[k]); });
  const auto matched_right = std::count(right.begin(), right.end(), true);
  std::printf(
      "  closures: %zu candidates, %d within 12 m; matched %zd right, %zd wrong, %.0f ms "
      "each; consistent %zd right, %zd wrong\n",
      candidates.size(),
      near,
      matched_right,
      static_cast<std::ptrdiff_t>(right.size()) - matched_right,
      match_ms,
      kept_right,
      static_cast<std::ptrdiff_t>(set.kept.size()) - kept_right);
}

void Evaluate(const Recording& recording, const Settings& settings) {
  const Places places = Describe(recording);
  const auto wanted = [&](const char* table) {
    return settings.table.empty() || settings.table == table;
  };
  if (wanted("descriptor")) PrintDescriptorTable(places);
  if (wanted("localisation")) PrintLocalisationTable(places, settings);
  if (wanted("closures")) PrintClosureTable(places, settings);
  std::fflush(stdout);
}

int Main(int argc, char** argv) {
  CLI::App app("place recognition");
  Settings settings;
  app.add_option("--only", settings.only, "one recording or world");
  app.add_option("--table", settings.table)
      ->check(CLI::IsMember({"descriptor", "localisation", "closures"}));
  app.add_flag("--verbose", settings.verbose, "a line a match");
  app.add_option("--beside", settings.beside)->capture_default_str();
  app.add_option("--noise-m", settings.noise.translation_sigma_m)->capture_default_str();
  app.add_option("--noise-rad", settings.noise.rotation_sigma_rad)->capture_default_str();
  app.add_option("--drift-m", settings.drift.drift_m)->capture_default_str();
  app.add_option("--drift-rad", settings.drift.drift_rad)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const auto wanted = [&](const std::string& name) {
    return settings.only.empty() || settings.only == name;
  };
  for (const std::string name : {"nclt_campus_loop", "hall_livox_loop"}) {
    if (const auto f = testing::FindData(name); f.has_value() && wanted(name)) {
      Evaluate(Load(*f), settings);
    }
  }
  struct Drawn {
    std::string name;
    testing::World world;
    bool loops;
  };
  for (const Drawn& d : {Drawn{"campus", testing::CampusWorld(), false},
                         Drawn{"campus_loop", testing::CampusLoopWorld(), false},
                         Drawn{"car_park", testing::CarParkWorld(), true},
                         Drawn{"bridge", testing::BridgeWorld(), true}}) {
    if (!wanted(d.name)) continue;
    Evaluate(Simulate(d.name, d.world, d.loops ? d.world.loops : d.world.robots, settings),
             settings);
  }
  return 0;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }
