#include "core/engine/consistency/contradicted_joins.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "absl/status/status.h"

#include "core/common/disjoint_sets.h"
#include "core/common/status.h"
#include "core/registration/place_match.h"

namespace strata {
namespace {

using Nodes = std::pair<std::size_t, std::size_t>;

// A closure as sure as this joins whatever scans say of each other: cars park elsewhere the next
// day.
constexpr double kSure = 0.6;
// Scans of both parts that are compared, spread over the smaller part.
constexpr std::size_t kMostCompared = 24;
constexpr std::size_t kLeastCompared = 5;
constexpr double kNearM = 5.0;
constexpr double kSameStoreyM = 1.0;
// The middle of what two parts contradict each other is too much above this, and so many times what
// nine of ten scans of one robot contradict those before them.
constexpr double kLeastContradiction = 0.01;
constexpr double kTimesOfOneRobot = 3.0;

// Which nodes the edges join.
std::vector<std::size_t> PartsBy(std::span<const GraphEdge> edges, std::size_t nodes) {
  DisjointSets joined;
  for (const GraphEdge& edge : edges) joined.Join(edge.i, edge.j);
  std::vector<std::size_t> parts(nodes);
  for (std::size_t k = 0; k < nodes; ++k) parts[k] = joined.Root(k);
  return parts;
}

// By itself, or as it says what the frames of both robots do.
bool IsSure(const GraphWorld& world, const FoundClosure& closure) {
  const Pose T_map_j = world.Poses()[closure.i] * closure.T_i_j;
  return closure.confidence >= kSure || IsWithin(T_map_j, SaidHypothesis(world.Poses()[closure.j]));
}

std::optional<std::size_t> NearestOf(const std::vector<std::size_t>& nodes,
                                     std::span<const Pose> T_map_scan,
                                     std::size_t node) {
  std::optional<std::size_t> nearest;
  double least_m = kNearM;
  for (const std::size_t other : nodes) {
    const Eigen::Vector3d way = T_map_scan[other].translation() - T_map_scan[node].translation();
    if (std::abs(way.z()) > kSameStoreyM || way.norm() >= least_m) continue;
    least_m = way.norm();
    nearest = other;
  }
  return nearest;
}

std::vector<Nodes> PairsAcross(const std::vector<std::size_t>& a,
                               const std::vector<std::size_t>& b,
                               std::span<const Pose> T_map_scan) {
  std::vector<Nodes> near;
  for (const std::size_t node : a) {
    const std::optional<std::size_t> other = NearestOf(b, T_map_scan, node);
    if (other.has_value()) near.emplace_back(node, *other);
  }
  std::vector<Nodes> pairs;
  const std::size_t step = (near.size() + kMostCompared - 1) / kMostCompared;
  for (std::size_t k = 0; k < near.size(); k += step) pairs.push_back(near[k]);
  return pairs;
}

// Of both nodes of each pair, each with the scan before it.
std::vector<Nodes> StepsOf(const GraphWorld& world, const std::vector<Nodes>& pairs) {
  std::vector<Nodes> steps;
  for (const Nodes& pair : pairs) {
    for (const std::size_t node : {pair.first, pair.second}) {
      const auto& [trajectory, index] = world.PlaceOf(node);
      if (index > 0) steps.emplace_back(world.Trajectories()[trajectory][index - 1], node);
    }
  }
  return steps;
}

// Ascending; without what is damaged.
absl::StatusOr<std::vector<double>> ContradictionsOf(ScanViews& views,
                                                     std::span<const Pose> T_map_scan,
                                                     const std::vector<Nodes>& pairs) {
  std::vector<double> contradictions;
  for (const Nodes& pair : pairs) {
    const absl::StatusOr<double> contradiction = ContradictionAt(views, T_map_scan, pair);
    if (absl::IsDataLoss(contradiction.status())) continue;
    STRATA_RETURN_IF_ERROR(contradiction.status());
    contradictions.push_back(*contradiction);
  }
  std::ranges::sort(contradictions);
  return contradictions;
}

absl::StatusOr<bool> Contradict(const GraphWorld& world,
                                ScanViews& views,
                                std::span<const Pose> T_map_scan,
                                const std::vector<Nodes>& pairs) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<double> across,
                          ContradictionsOf(views, T_map_scan, pairs));
  if (across.size() < kLeastCompared) return false;
  STRATA_ASSIGN_OR_RETURN(const std::vector<double> steps,
                          ContradictionsOf(views, T_map_scan, StepsOf(world, pairs)));
  const double of_one = steps.empty() ? 0.0 : steps[steps.size() * 9 / 10];
  return across[across.size() / 2] > std::max(kLeastContradiction, kTimesOfOneRobot * of_one);
}

}  // namespace

absl::StatusOr<double> ContradictionAt(ScanViews& views,
                                       std::span<const Pose> T_map_scan,
                                       const std::pair<std::size_t, std::size_t>& nodes) {
  STRATA_ASSIGN_OR_RETURN(const auto first, views.Features(nodes.first));
  STRATA_ASSIGN_OR_RETURN(const auto second, views.Features(nodes.second));
  return ContradictionOf(
      {first.get(), T_map_scan[nodes.first], views.SensorOrigin(nodes.first)},
      {second.get(), T_map_scan[nodes.second], views.SensorOrigin(nodes.second)});
}

absl::StatusOr<std::vector<std::size_t>> ContradictedJoins(const GraphWorld& world,
                                                           ScanViews& views,
                                                           std::span<const GraphEdge> edges,
                                                           std::span<const FoundClosure> closures,
                                                           std::span<const Pose> T_map_scan) {
  const std::vector<std::size_t> parts = PartsBy(edges, world.size());
  std::map<Nodes, std::vector<std::size_t>> joins;  // closures of two parts
  for (std::size_t k = 0; k < closures.size(); ++k) {
    const Nodes two = std::minmax(parts[closures[k].i], parts[closures[k].j]);
    if (two.first != two.second) joins[two].push_back(k);
  }
  std::vector<std::size_t> contradicted;
  for (const auto& [two, members] : joins) {
    const bool is_sure =
        std::ranges::any_of(members, [&](std::size_t k) { return IsSure(world, closures[k]); });
    if (is_sure) continue;
    std::vector<std::size_t> first, second;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      if (parts[k] == two.first) first.push_back(k);
      if (parts[k] == two.second) second.push_back(k);
    }
    if (first.size() > second.size()) std::swap(first, second);
    STRATA_ASSIGN_OR_RETURN(
        const bool contradict,
        Contradict(world, views, T_map_scan, PairsAcross(first, second, T_map_scan)));
    if (contradict) contradicted.insert(contradicted.end(), members.begin(), members.end());
  }
  std::ranges::sort(contradicted);
  return contradicted;
}

}  // namespace strata
