#include "core/posegraph/alignment/scan_chains.h"

#include <algorithm>
#include <cmath>

#include "core/common/disjoint_sets.h"
#include "core/posegraph/alignment/parts.h"
#include "core/registration/neighbours.h"

namespace strata {
namespace {

// Scans farther apart than this in the order of their trajectory are of different passes.
constexpr std::size_t kSamePass = 5;

// The parts of the problem that ways, relative poses of any kind, or priors hold together.
std::vector<std::size_t> PartsOfProblem(const AlignmentProblem& problem) {
  DisjointSets joined;
  for (const ScanPair& pair : problem.pairs) joined.Join(pair.i, pair.j);
  for (const RelativePoseTerm& term : problem.relative) joined.Join(term.i, term.j);
  for (const std::vector<std::size_t>& way : problem.trajectories) {
    for (const std::size_t node : way) joined.Join(node, way[0]);
  }
  for (const PriorTerm& prior : problem.priors) joined.Join(prior.i, problem.priors[0].i);
  return PartsOf(joined, problem.T_map_scan.size());
}

}  // namespace

ScanChains::ScanChains(const AlignmentProblem& problem, const NeighbourPolicy& policy)
    : policy_(policy), trajectories_(problem.trajectories), part_(PartsOfProblem(problem)) {
  ++policy_.max_scans;  // a scan is its own nearest
  const std::size_t nodes = problem.T_map_scan.size();
  way_.resize(nodes);
  partners_.resize(nodes);
  for (std::size_t t = 0; t < problem.trajectories.size(); ++t) {
    for (std::size_t k = 0; k < problem.trajectories[t].size(); ++k) {
      way_[problem.trajectories[t][k]] = {t, k};
    }
  }
  for (const ScanPair& pair : problem.pairs) {
    if (pair.measured.has_value()) continue;  // that says it all
    partners_[pair.i].push_back({pair.j, pair.may_be_false});
    partners_[pair.j].push_back({pair.i, pair.may_be_false});
  }
  for (const auto& [i, j] : problem.excluded_pairs) excluded_.insert(std::minmax(i, j));
}

bool ScanChains::OwnPass(std::size_t node, std::size_t other) const {
  const auto [trajectory, place] = way_[node];
  const auto [other_trajectory, other_place] = way_[other];
  return trajectory == other_trajectory &&
         std::max(place, other_place) - std::min(place, other_place) <= kOwnPass;
}

// Of what follows `before` on its trajectory, up to but without `end`.
bool ScanChains::IsLooseBetween(const Place& before,
                                std::size_t end,
                                const std::vector<bool>& loose) const {
  if (loose.empty()) return false;
  const std::vector<std::size_t>& trajectory = trajectories_[before.first];
  for (std::size_t k = before.second + 1; k < end; ++k) {
    if (loose[trajectory[k]]) return true;
  }
  return false;
}

std::vector<ScanChain> ScanChains::Around(std::size_t node,
                                          std::span<const Pose> T_map_scan,
                                          const std::vector<bool>& loose) const {
  // With whether more than nearness speaks for it.
  std::vector<std::pair<Place, std::pair<std::size_t, bool>>> around;
  const auto add = [&](std::size_t other, bool known) {
    if (!known && part_[other] != part_[node]) return;
    if (other == node || excluded_.contains(std::minmax(node, other))) return;
    if (OwnPass(node, other) && way_[other].second > way_[node].second) return;
    around.push_back({way_[other], {other, known}});
  };
  for (const std::size_t other : SelectNeighbours(T_map_scan, T_map_scan[node], policy_)) {
    const double rise_m =
        std::abs(T_map_scan[other].translation().z() - T_map_scan[node].translation().z());
    if (OwnPass(node, other) || rise_m <= kSameStoreyM) add(other, false);
  }
  for (const Partner& partner : partners_[node]) add(partner.node, !partner.may_be_false);
  std::sort(around.begin(), around.end());
  std::vector<ScanChain> chains;
  Place last;
  for (const auto& [way, other] : around) {
    const bool same_pass = !chains.empty() && way.first == last.first &&
                           way.second - last.second <= kSamePass &&
                           !IsLooseBetween(last, way.second + 1, loose);
    if (!same_pass) chains.push_back({{}, false, true});
    ScanChain& chain = chains.back();
    chain.own =
        chain.own || (OwnPass(node, other.first) && !IsLooseBetween(way, way_[node].second, loose));
    if (chain.own || other.second) chain.may_be_false = false;
    if (chain.nodes.empty() || chain.nodes.back() != other.first) {
      chain.nodes.push_back(other.first);
    }
    last = way;
  }
  return chains;
}

}  // namespace strata
