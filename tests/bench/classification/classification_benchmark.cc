// Classification of points beside CGAL 5.5's: ratios of one run, medians, processor time of one
// thread, on the clouds of Oakland 3-D.
//
//   classification_benchmark [--rounds 3] [--only NAME] [--points N]
//
//   features   eigenvalue shape at one scale and wall histograms, 16 neighbours, against CGAL's
//              feature set at one scale
//   cut        α-expansion against CGAL's graph cut: same points, neighbours and energy
//   training   an AMN against CGAL's forest on the same reduced points and features
//   scan       70,000 points by AMN and iAMN, features included
//   memory     a million points by AMN: the most that the process held
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "core/classification/amn/amn_inference.h"
#include "core/classification/amn/amn_learning.h"
#include "core/classification/features/neighbours.h"
#include "core/classification/training.h"
#include "tests/bench/classification/classification_peers.h"
#include "tests/support/labelled_clouds.h"

namespace strata::bench {
namespace {

double ProcessorSeconds() {
  return static_cast<double>(std::clock()) / static_cast<double>(CLOCKS_PER_SEC);
}

// Of every one of what is run, in turns, so that what else the machine does meets all alike.
std::vector<double> MedianSeconds(int rounds, const std::vector<std::function<void()>>& runs) {
  std::vector<std::vector<double>> seconds(runs.size());
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t k = 0; k < runs.size(); ++k) {
      const double start_s = ProcessorSeconds();
      runs[k]();
      seconds[k].push_back(ProcessorSeconds() - start_s);
    }
  }
  std::vector<double> medians;
  for (std::vector<double>& of_one : seconds) {
    std::sort(of_one.begin(), of_one.end());
    medians.push_back(of_one[of_one.size() / 2]);
  }
  return medians;
}

double MedianSeconds(int rounds, const std::function<void()>& run) {
  return MedianSeconds(rounds, std::vector{run}).front();
}

PointCloud FirstPoints(const PointCloud& cloud, std::size_t count) {
  PointCloud first = cloud;
  first.points.resize(std::min(count, cloud.size()));
  first.label.resize(first.points.size());
  return first;
}

void MeasureFeatures(const PointCloud& cloud, int rounds) {
  PointFeatureOptions shape;
  shape.scales = 1;
  PointFeatureOptions wall;
  wall.set = FeatureSet::kWall;
  const std::vector<double> seconds =
      MedianSeconds(rounds,
                    {[&] { CgalFeatures(cloud.points, 1, -1.0F); },
                     [&] { ComputeFeatures(cloud, shape, Stop()).value(); },
                     [&] { ComputeFeatures(cloud, wall, Stop()).value(); }});
  const double cgal_s = seconds[0];
  const double shape_s = seconds[1];
  const double wall_s = seconds[2];
  const auto k_points = static_cast<double>(cloud.size()) / 1e3;
  std::printf("features, %zu points: CGAL %.0f k points/s\n", cloud.size(), k_points / cgal_s);
  std::printf("  shape %.0f k points/s, ratio %.2f\n", k_points / shape_s, cgal_s / shape_s);
  std::printf("  wall %.0f k points/s, ratio %.2f\n", k_points / wall_s, cgal_s / wall_s);
}

absl::Status NoProgress(double) { return absl::OkStatus(); }

LabelledFeatures Known(const PointCloud& cloud,
                       std::size_t classes,
                       std::vector<Eigen::Vector3f>& positions) {
  const FeatureMatrix features = ComputeFeatures(cloud, {}, Stop()).value();
  LabelledFeatures known;
  known.classes = classes;
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.label[i] == 0) continue;
    rows.push_back(static_cast<Eigen::Index>(i));
    positions.push_back(cloud.points[i]);
    known.labels.push_back(static_cast<ClassIndex>(cloud.label[i] - 1));
  }
  known.features = features(rows, Eigen::all);
  return known;
}

double EnergyOf(const ScoreMatrix& costs,
                const std::vector<NetworkEdge>& edges,
                double strength,
                const std::vector<ClassIndex>& labels) {
  double energy = 0.0;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    energy += costs(static_cast<Eigen::Index>(i), labels[i]);
  }
  for (const NetworkEdge& edge : edges) energy += labels[edge.i] != labels[edge.j] ? strength : 0.0;
  return energy;
}

constexpr double kSameEnergy = 1e-3;

// Every pair once, though both may be among the nearest of the other.
std::vector<NetworkEdge> NearestPairs(const PointCloud& cloud, std::size_t count) {
  const Neighbours neighbours = Neighbours::Find(cloud.points, count);
  std::vector<NetworkEdge> edges;
  for (std::uint32_t i = 0; i < neighbours.size(); ++i) {
    for (const std::uint32_t j : neighbours.Of(i))
      edges.push_back({std::min(i, j), std::max(i, j)});
  }
  const auto before = [](const NetworkEdge& a, const NetworkEdge& b) {
    return a.i != b.i ? a.i < b.i : a.j < b.j;
  };
  std::sort(edges.begin(), edges.end(), before);
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

// Whether no cut of CGAL's is better by more than rounding.
bool MeasureCut(const std::string& name,
                const ScoreMatrix& costs,
                const std::vector<NetworkEdge>& edges,
                double strength,
                int rounds) {
  AmnProblem problem;
  problem.node_scores = -costs;
  problem.edges = edges;
  problem.edge_scores = Eigen::VectorXd::Constant(costs.cols(), strength);
  std::vector<ClassIndex> labels;
  const double ours_s =
      MedianSeconds(rounds, [&] { labels = MaximizeScore(problem, Stop()).value().labels; });
  const double energy = EnergyOf(costs, edges, strength, labels);
  std::printf("cut, %s: ours %.3f s, energy %.6g\n", name.c_str(), ours_s, energy);
  bool as_good = true;
  for (const GraphCut method : {GraphCut::kBoost, GraphCut::kMaxFlow}) {
    const double cgal_s =
        MedianSeconds(rounds, [&] { labels = CgalGraphCut(method, costs, edges, strength); });
    const double more = EnergyOf(costs, edges, strength, labels) - energy;
    std::printf("  %s %.3f s, ratio %.1f, its energy - ours %.3g\n",
                method == GraphCut::kBoost ? "as classify_with_graphcut" : "by its MaxFlow",
                cgal_s,
                cgal_s / ours_s,
                more);
    as_good = as_good && more >= -kSameEnergy * energy;
  }
  return as_good;
}

bool MeasureCuts(const testing::LabelledClouds& oakland, const PointCloud& cloud, int rounds) {
  std::vector<Eigen::Vector3f> positions;
  const LabelledFeatures known = Known(oakland.clouds[1], oakland.classes.size(), positions);
  const CgalForest forest(Reduce(positions, known, {}).data);
  const ScoreMatrix costs =
      -(forest.Probabilities(ComputeFeatures(cloud, {}, Stop()).value()).array().max(1e-4).log())
           .matrix();
  const bool nearest =
      MeasureCut("12 nearest, weight 0.2", costs, NearestPairs(cloud, 12), 0.2, rounds);
  const bool drawn = MeasureCut("network of degree 3, weight 1",
                                costs,
                                DrawNetwork(Neighbours::Find(cloud.points, 16), {}),
                                1.0,
                                rounds);
  return nearest && drawn;
}

void MeasureTraining(const testing::LabelledClouds& oakland, int rounds) {
  std::vector<Eigen::Vector3f> positions;
  const LabelledFeatures known = Known(oakland.clouds[1], oakland.classes.size(), positions);
  const ReducedPoints reduced = Reduce(positions, known, {});
  const std::vector<NetworkEdge> edges = DrawNetwork(Neighbours::Find(reduced.positions, 16), {});
  const LabelledFeatures& data = reduced.data;
  AmnLearningOptions options;
  options.tolerance = 1e-2;
  const std::vector<double> seconds = MedianSeconds(
      rounds,
      {[&] {
         LearnByCuttingPlanes({data.features, edges, data.labels, data.classes}, options, Stop())
             .value();
       },
       [&] { CgalForest forest(data); }});
  const double ours_s = seconds[0];
  const double cgal_s = seconds[1];
  std::printf("training, %zu points: AMN %.2f s, CGAL's forest %.2f s, ratio %.2f\n",
              data.size(),
              ours_s,
              cgal_s,
              cgal_s / ours_s);
}

Classifier Trained(const testing::LabelledClouds& oakland, ClassifierMethod method) {
  TrainingOptions options;
  options.method = method;
  return TrainClassifier(oakland.clouds, oakland.classes, options, NoProgress, Stop()).value();
}

void MeasureScan(const testing::LabelledClouds& oakland, const PointCloud& cloud, int rounds) {
  const PointCloud scan = FirstPoints(cloud, 70'000);
  for (const ClassifierMethod method : {ClassifierMethod::kAmn, ClassifierMethod::kInstanceAmn}) {
    const Classifier classifier = Trained(oakland, method);
    const double seconds =
        MedianSeconds(rounds, [&] { Classify(classifier, scan, Stop()).value(); });
    std::printf("scan, %zu points by %s: %.2f s\n",
                scan.size(),
                std::string(ToString(method)).c_str(),
                seconds);
  }
}

// Of /proc/self/status, in MB.
double MostHeldMb() {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    double kb = 0.0;
    if (word == "VmHWM:" && status >> kb) return kb / 1024.0;
  }
  return 0.0;
}

void MeasureMemory(const testing::LabelledClouds& oakland, const PointCloud& cloud) {
  const Classifier classifier = Trained(oakland, ClassifierMethod::kAmn);
  PointCloud million;
  for (float shift_m = 0.0F; million.size() < 1'000'000; shift_m += 500.0F) {
    for (const Eigen::Vector3f& p : cloud.points) {
      if (million.size() == 1'000'000) break;
      million.points.emplace_back(p + Eigen::Vector3f(shift_m, 0.0F, 0.0F));
    }
  }
  std::ofstream("/proc/self/clear_refs") << "5";  // forgets the most so far
  const double start_s = ProcessorSeconds();
  Classify(classifier, million, Stop()).value();
  std::printf("memory, %zu points by amn: %.0f MB, %.1f s\n",
              million.size(),
              MostHeldMb(),
              ProcessorSeconds() - start_s);
}

int Main(int argc, char** argv) {
  CLI::App app("classification beside CGAL's");
  int rounds = 3;
  std::string only;
  std::size_t points = SIZE_MAX;
  app.add_option("--rounds", rounds)->check(CLI::Range(1, 100));
  app.add_option("--only", only);
  app.add_option("--points", points, "most of the cloud that is asked for");
  CLI11_PARSE(app, argc, argv);
  const testing::LabelledClouds oakland = testing::ReadOakland("part3");
  const testing::LabelledClouds asked = testing::ReadOakland("part2");
  if (oakland.clouds.empty() || asked.clouds.empty()) {
    std::printf("no data\n");
    return 0;
  }
  const PointCloud cloud = FirstPoints(asked.clouds.front(), points);
  const auto wanted = [&only](const std::string& name) { return only.empty() || only == name; };
  if (wanted("memory")) MeasureMemory(oakland, cloud);
  if (wanted("features")) MeasureFeatures(cloud, rounds);
  const bool as_good = !wanted("cut") || MeasureCuts(oakland, cloud, rounds);
  if (wanted("training")) MeasureTraining(oakland, rounds);
  if (wanted("scan")) MeasureScan(oakland, cloud, rounds);
  return as_good ? 0 : 1;
}

}  // namespace
}  // namespace strata::bench

int main(int argc, char** argv) { return strata::bench::Main(argc, argv); }
