// Which scans show the same place? Recorded loops and simulated ones, against the true poses.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "core/cloud/sensor_model.h"
#include "core/mls/build.h"
#include "core/mls/join.h"
#include "core/posegraph/closure_candidates.h"
#include "core/posegraph/closure_consistency.h"
#include "core/registration/place_descriptor.h"
#include "core/registration/place_index.h"
#include "core/registration/place_match.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"
#include "tests/support/simulator.h"
#include "tests/support/worlds.h"

namespace strata {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

struct Recording {
  std::string name;
  std::vector<PointCloud> clouds;
  std::vector<Pose> uploaded;
  std::vector<Pose> reference;
};

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
                   const testing::Robot& robot,
                   double step_m,
                   const testing::OdometryNoise& noise) {
  Recording r;
  r.name = name;
  r.reference = testing::Drive(world.scene, robot.waypoints, step_m, 1.2);
  r.uploaded = testing::NoisyOdometry(r.reference, noise, 1);
  testing::SensorOptions sensor;
  sensor.columns = 480;
  for (std::size_t i = 0; i < r.reference.size(); ++i) {
    r.clouds.push_back(testing::SimulateScan(world.scene, sensor, r.reference[i], i + 1));
  }
  return r;
}

// The local map of `pool` scans that end with scan i, in the frame of scan i.
MlsMap LocalMap(const Recording& r, std::size_t i, int pool) {
  MlsMap map;
  for (std::size_t j = i + 1 > static_cast<std::size_t>(pool) ? i + 1 - pool : 0; j <= i; ++j) {
    JoinInto(map,
             BuildMlsMap(r.clouds[j],
                         Normalized(r.uploaded[i].inverse() * r.uploaded[j]),
                         SensorModel(),
                         map.parameters)
                 ->map);
  }
  return map;
}

struct Pair {
  std::size_t i, j;
  double distance;
  double heading_error_deg;
  double apart_m;
};

double YawRad(const Eigen::Matrix3d& R) { return std::atan2(R(1, 0), R(0, 0)); }

void EvaluateMatches(const Recording& r, int pool, std::size_t count, bool verbose);

void EvaluateDescriptor(const Recording& r, int pool, const PlaceDescriptorOptions& options) {
  std::vector<PlaceDescriptor> places;
  std::vector<double> way = {0.0};
  double ms = 0.0;
  for (std::size_t i = 0; i < r.clouds.size(); ++i) {
    const MlsMap map = LocalMap(r, i, pool);
    const auto start = std::chrono::steady_clock::now();
    places.push_back(DescribePlace(map, options));
    ms +=
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    if (i > 0) {
      way.push_back(way.back() +
                    (r.reference[i].translation() - r.reference[i - 1].translation()).norm());
    }
  }
  std::vector<Pair> pairs;
  for (std::size_t j = 0; j < places.size(); ++j) {
    for (std::size_t i = 0; i < j && way[j] - way[i] > 30.0; ++i) {
      const PlaceSimilarity s = ComparePlaces(places[i], places[j]);
      const Pose T_i_j = r.reference[i].inverse() * r.reference[j];
      const double yaw = YawRad(T_i_j.linear()) - s.heading_rad;
      const double error = std::abs(std::remainder(yaw, std::numbers::pi)) * kDegrees;
      pairs.push_back({i, j, s.distance, error, T_i_j.translation().norm()});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) {
    return a.distance < b.distance;
  });
  std::printf("%-16s %4zu scans pool %d, %.1f ms:",
              r.name.c_str(),
              places.size(),
              pool,
              ms / static_cast<double>(places.size()));
  for (const double radius : {5.0, 12.0}) {
    std::size_t all = 0, first = 0, good_heading = 0;
    bool wrong = false;
    for (const Pair& p : pairs) {
      const bool is_true = p.apart_m < radius;
      all += is_true;
      good_heading += is_true && p.heading_error_deg < 5.0;
      wrong = wrong || p.apart_m > std::max(radius, 12.0);
      first += is_true && !wrong;
    }
    std::size_t queries = 0, top1 = 0, top10 = 0;
    for (std::size_t j = 0; j < places.size(); ++j) {
      int rank = 0;
      bool any = false, in1 = false, in10 = false;
      for (const Pair& p : pairs) {
        if (p.j != j) continue;
        const bool is_true = p.apart_m < radius;
        any = any || is_true;
        in1 = in1 || (is_true && rank < 1);
        in10 = in10 || (is_true && rank < 10);
        ++rank;
      }
      queries += any;
      top1 += any && in1;
      top10 += any && in10;
    }
    std::printf(
        " | %.0f m: %zu true, recall@100%% %.3f, heading %.2f, top-1 %.2f top-10 %.2f of %zu",
        radius,
        all,
        all ? double(first) / all : 0,
        all ? double(good_heading) / all : 0,
        queries ? double(top1) / queries : 0,
        queries ? double(top10) / queries : 0,
        queries);
  }
  std::printf("\n");
  std::fflush(stdout);
}

// What the matcher makes of the pairs that look alike, true and false.
void EvaluateMatches(const Recording& r, int pool, std::size_t count, bool verbose) {
  std::vector<PlaceDescriptor> places;
  std::vector<ScanFeatures> features;
  std::vector<double> way = {0.0};
  for (std::size_t i = 0; i < r.clouds.size(); ++i) {
    const MlsMap map = LocalMap(r, i, pool);
    places.push_back(DescribePlace(map));
    features.push_back(ScanFeatures::FromMap(map));
    if (i > 0) {
      way.push_back(way.back() +
                    (r.reference[i].translation() - r.reference[i - 1].translation()).norm());
    }
  }
  struct Query {
    std::size_t i, j;
    PlaceSimilarity s;
    Pose truth;
  };
  std::vector<Query> near, far;
  for (std::size_t j = 0; j < places.size(); ++j) {
    for (std::size_t i = 0; i < j && way[j] - way[i] > 30.0; ++i) {
      const Query q{
          i, j, ComparePlaces(places[i], places[j]), r.reference[i].inverse() * r.reference[j]};
      const double apart = q.truth.translation().norm();
      if (apart < 12.0) near.push_back(q);
      if (apart > 30.0) far.push_back(q);
    }
  }
  const auto by_distance = [](const Query& a, const Query& b) {
    return a.s.distance < b.s.distance;
  };
  std::stable_sort(far.begin(), far.end(), by_distance);
  if (far.size() > count) far.resize(count);
  std::vector<Query> spread;
  for (std::size_t k = 0; k < std::min(count, near.size()); ++k) {
    spread.push_back(near[k * near.size() / std::min(count, near.size())]);
  }
  for (const bool is_near : {true, false}) {
    int right = 0, wrong = 0, verdicts[5] = {};
    double worst_right = 2.0, best_wrong = 0.0, ms = 0.0;
    const auto& queries = is_near ? spread : far;
    for (const Query& q : queries) {
      const std::vector<PlaceHypothesis> hypotheses = HypothesesOf(q.s, Pose::Identity());
      const SeenScan target[] = {{&features[q.i]}};
      const auto start = std::chrono::steady_clock::now();
      const PlaceMatch m = MatchPlace({&features[q.j]}, target, hypotheses);
      ms += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
                .count();
      const Pose error = q.truth.inverse() * m.T_target_source;
      const bool correct = error.translation().norm() < 0.5 && RotationAngleRad(error) < 0.05;
      ++verdicts[static_cast<int>(m.verdict)];
      if (m.matched()) {
        ++(correct ? right : wrong);
        if (correct) worst_right = std::min(worst_right, m.confidence);
        if (!correct) best_wrong = std::max(best_wrong, m.confidence);
      }
      if (verbose) {
        std::printf(
            "  %zu-%zu %s apart %.1f desc %.2f %-12s overlap %.2f against %.3f rival %.2f "
            "rms %.3f conf %.2f error %.2f m %.1f deg\n",
            q.i,
            q.j,
            is_near ? "near" : "far",
            q.truth.translation().norm(),
            q.s.distance,
            std::string(ToString(m.verdict)).c_str(),
            m.overlap,
            m.contradiction,
            m.rival,
            m.rms_m,
            m.confidence,
            error.translation().norm(),
            RotationAngleRad(error) * kDegrees);
      }
    }
    std::printf(
        "%-16s %s %3zu pairs: matched right %d (least confidence %.2f), matched wrong %d "
        "(most %.2f), no fit %d, degenerate %d, contradicted %d, ambiguous %d; %.0f ms\n",
        r.name.c_str(),
        is_near ? "<12 m" : ">30 m",
        queries.size(),
        right,
        worst_right,
        wrong,
        best_wrong,
        verdicts[1],
        verdicts[2],
        verdicts[3],
        verdicts[4],
        queries.empty() ? 0.0 : ms / static_cast<double>(queries.size()));
    std::fflush(stdout);
  }
}

struct Described {
  std::vector<PlaceDescriptor> places;
  std::vector<ScanFeatures> features;
};

Described Describe(const Recording& r, int pool) {
  Described d;
  for (std::size_t i = 0; i < r.clouds.size(); ++i) {
    const MlsMap map = LocalMap(r, i, pool);
    d.places.push_back(DescribePlace(map));
    d.features.push_back(ScanFeatures::FromMap(map));
  }
  return d;
}

// Scan i and its `beside` neighbours to both sides, in the frame of i.
std::vector<SeenScan> TargetOf(const Recording& r,
                               const Described& d,
                               std::size_t i,
                               std::size_t beside) {
  std::vector<SeenScan> target = {{&d.features[i]}};
  for (std::size_t k = 1; k <= beside; ++k) {
    for (const std::size_t j : {i - k, i + k}) {
      if (j >= r.clouds.size()) continue;
      target.push_back({&d.features[j], Normalized(r.uploaded[i].inverse() * r.uploaded[j])});
    }
  }
  return target;
}

// From candidates to consistent closures, the uploaded poses being the prior.
void EvaluateClosures(
    const Recording& r, int pool, std::size_t beside, const DriftOptions& drift, bool verbose) {
  const Described d = Describe(r, pool);
  const auto now = [] { return std::chrono::steady_clock::now(); };
  const auto ms_since = [&](auto start) {
    return std::chrono::duration<double, std::milli>(now() - start).count();
  };
  std::vector<ClosureNode> nodes;
  std::vector<GraphEdge> edges;
  PlaceIndex index;
  std::vector<AlikePair> alike;
  for (std::size_t j = 0; j < r.clouds.size(); ++j) {
    nodes.push_back({r.uploaded[j], 1});
    if (j > 0) edges.push_back({j - 1, j, 1e4 * Matrix6d::Identity()});
    for (const auto& n :
         index.Nearest(d.places[j], 5, [&](std::uint64_t i) { return i + 15 > j; })) {
      alike.push_back({static_cast<std::size_t>(n.number), j, n.similarity});
    }
    index.Add(j, d.places[j]);
  }
  ClosureCandidateOptions options;
  options.drift = drift;
  auto start = now();
  const auto candidates = FindClosureCandidates(nodes, edges, alike, options).value();
  const double candidates_ms = ms_since(start);
  start = now();
  std::vector<Closure> closures;
  std::vector<bool> right;
  int near = 0;
  for (const ClosureCandidate& c : candidates) {
    const Pose truth = r.reference[c.i].inverse() * r.reference[c.j];
    near += static_cast<int>(truth.translation().norm() < 12.0);
    const PlaceMatch m = MatchPlace({&d.features[c.j]}, TargetOf(r, d, c.i, beside), c.hypotheses);
    const Pose error = truth.inverse() * m.T_target_source;
    const bool correct = error.translation().norm() < 0.5 && RotationAngleRad(error) < 0.05;
    if (verbose) {
      std::printf(
          "  %zu-%zu %s sigma %.1f m %.2f rad score %.2f apart %.1f: %s overlap %.2f through "
          "%.3f rival %.2f conf %.2f error %.2f m %.1f deg\n",
          c.i,
          c.j,
          c.reason == ClosureReason::kNear ? "near " : "alike",
          c.sigma_m,
          c.sigma_rad,
          c.score,
          truth.translation().norm(),
          std::string(ToString(m.verdict)).c_str(),
          m.overlap,
          m.contradiction,
          m.rival,
          m.confidence,
          error.translation().norm(),
          RotationAngleRad(error) * kDegrees);
    }
    if (!m.matched()) continue;
    closures.push_back({c.i, c.j, m.T_target_source, 0.2, 0.02});
    right.push_back(correct);
  }
  const double match_ms = ms_since(start);
  ClosureConsistencyOptions consistency;
  consistency.drift = drift;
  const auto set = ConsistentClosures(r.uploaded, edges, closures, consistency).value();
  int kept_right = 0;
  for (const std::size_t k : set.kept) kept_right += right[k];
  const auto matched_right = std::count(right.begin(), right.end(), true);
  std::printf(
      "%-16s %zu candidates (%d within 12 m) in %.0f ms, matched right %zd wrong %zd, %.0f ms "
      "each; consistent right %d wrong %zu\n",
      r.name.c_str(),
      candidates.size(),
      near,
      candidates_ms,
      matched_right,
      static_cast<std::ptrdiff_t>(right.size()) - matched_right,
      candidates.empty() ? 0.0 : match_ms / static_cast<double>(candidates.size()),
      kept_right,
      set.kept.size() - static_cast<std::size_t>(kept_right));
  std::fflush(stdout);
}

int Main(int argc, char** argv) {
  CLI::App app("place recognition");
  std::string only;
  int pool = 1;
  PlaceDescriptorOptions options;
  app.add_option("--only", only);
  app.add_option("--pool", pool);
  app.add_option("--radius", options.radius_m);
  app.add_option("--cell", options.cell_m);
  app.add_option("--min-height", options.min_height_m);
  app.add_option("--max-height", options.max_height_m);
  std::size_t matches = 0;
  bool verbose = false;
  bool closures = false;
  std::size_t beside = 0;
  DriftOptions drift{0.1, 0.01};
  testing::OdometryNoise noise;
  app.add_option("--noise-m", noise.translation_sigma_m);
  app.add_option("--noise-rad", noise.rotation_sigma_rad);
  app.add_flag("--closures", closures);
  app.add_option("--beside", beside);
  app.add_option("--drift", drift.drift_m);
  app.add_option("--drift-rad", drift.drift_rad);
  app.add_option("--matches", matches);
  app.add_flag("--verbose", verbose);
  CLI11_PARSE(app, argc, argv);
  const auto Evaluate = [&](const Recording& r) {
    if (closures) {
      EvaluateClosures(r, pool, beside, drift, verbose);
    } else if (matches > 0) {
      EvaluateMatches(r, pool, matches, verbose);
    } else {
      EvaluateDescriptor(r, pool, options);
    }
  };
  const auto wanted = [&](const std::string& name) { return only.empty() || only == name; };
  for (const std::string name : {"nclt_campus_loop", "hall_livox_loop"}) {
    if (const auto f = testing::FindData(name); f.has_value() && wanted(name)) {
      Evaluate(Load(*f));
    }
  }
  if (wanted("campus")) {
    const testing::World world = testing::CampusWorld();
    testing::Robot both = world.robots[0];
    both.waypoints.insert(
        both.waypoints.end(), world.robots[1].waypoints.begin(), world.robots[1].waypoints.end());
    Evaluate(Simulate("campus", world, both, 3.0, noise));
  }
  if (wanted("campus_loop")) {
    const testing::World world = testing::CampusLoopWorld();
    Evaluate(Simulate("campus_loop", world, world.robots[0], 2.0, noise));
  }
  if (wanted("car_park")) {
    const testing::World world = testing::CarParkWorld();
    Evaluate(Simulate("car_park", world, world.loops[0], 2.0, noise));
  }
  if (wanted("bridge")) {
    const testing::World world = testing::BridgeWorld();
    Evaluate(Simulate("bridge", world, world.loops[0], 2.0, noise));
  }
  return 0;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }
