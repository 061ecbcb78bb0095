// Looking up a place among many, and choosing pairs to close loops with, at 2,000 and 20,000 scans.
//   places_benchmark [--runs 5]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <vector>

#include <CLI/CLI.hpp>

#include "core/common/random.h"
#include "core/posegraph/closures/closure_candidates.h"
#include "core/registration/place_index.h"

namespace strata {
namespace {

template <typename Run>
double Milliseconds(int runs, const Run& run) {
  std::vector<double> times;
  for (int i = 0; i < runs; ++i) {
    const auto start = std::chrono::steady_clock::now();
    run();
    times.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
  }
  std::nth_element(times.begin(), times.begin() + runs / 2, times.end());
  return times[static_cast<std::size_t>(runs / 2)];
}

PlaceDescriptor RandomPlace(SplitMix64& random) {
  PlaceDescriptor place;
  for (auto& v : place.spectrum) {
    v = static_cast<std::int8_t>(static_cast<int>(random.Below(81)) - 40);
  }
  return place;
}

void MeasureIndex(std::size_t places, int runs) {
  SplitMix64 random(1);
  PlaceIndex index;
  for (std::size_t i = 0; i < places; ++i) index.Add(i, RandomPlace(random));
  const PlaceDescriptor wanted = RandomPlace(random);
  std::printf("index of %6zu places: %.2f ms for the 5 nearest\n", places, Milliseconds(runs, [&] {
                index.Nearest(wanted, 5, [](std::uint64_t) { return false; });
              }));
}

// Robots that each drive 5 km round blocks of 100 m in one city, a scan every metre, with a closure
// every 50 m.
void MeasureCandidates(std::size_t scans, int runs) {
  constexpr std::size_t kOfRobot = 5000;
  SplitMix64 random(2);
  std::vector<ClosureNode> nodes;
  std::vector<GraphEdge> edges;
  const Matrix6d information = 1e4 * Matrix6d::Identity();
  double heading = 0.0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < scans; ++i) {
    if (i % kOfRobot == 0) {
      place.setZero();
    } else {
      edges.push_back({i - 1, i, information});
      if (i % 100 == 0) heading += 0.5 * std::numbers::pi * (random.Below(2) == 0 ? 1.0 : -1.0);
      place += Eigen::Vector3d(std::cos(heading), std::sin(heading), 0.0);
    }
    ClosureNode node;
    node.T_map_scan.linear() =
        Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    node.T_map_scan.translation() = place;
    node.trajectory = static_cast<std::uint32_t>(i / kOfRobot);
    if (i % 50 == 0) {
      const auto near = std::find_if(nodes.begin(), nodes.end(), [&](const ClosureNode& other) {
        return (other.T_map_scan.translation() - place).norm() < 3.0;
      });
      const auto j = static_cast<std::size_t>(near - nodes.begin());
      if (j + 100 < i) edges.push_back({j, i, information});
    }
    nodes.push_back(node);
  }
  std::size_t found = 0;
  const double ms =
      Milliseconds(runs, [&] { found = FindClosureCandidates(nodes, edges, {}).value().size(); });
  std::printf("candidates of %6zu scans: %.0f ms, %zu found\n", scans, ms, found);
}

int Main(int argc, char** argv) {
  CLI::App app("places and closure candidates");
  int runs = 5;
  app.add_option("--runs", runs)->check(CLI::Range(1, 1000))->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  for (const std::size_t scans : {2000, 20000}) MeasureIndex(scans, runs);
  for (const std::size_t scans : {2000, 20000}) MeasureCandidates(scans, runs);
  return 0;
}

}  // namespace
}  // namespace strata

int main(int argc, char** argv) { return strata::Main(argc, argv); }
