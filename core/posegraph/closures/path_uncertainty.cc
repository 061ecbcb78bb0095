#include "core/posegraph/closures/path_uncertainty.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <queue>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "core/common/option_checks.h"

namespace strata {
namespace {

// What an undetermined direction is known to at best [1/rad², 1/m²].
constexpr double kLeastInformation = 1e-4;
// A path is chosen by the position's variance this far from its end [m].
constexpr double kLeverM = 20.0;
// A rotation about a random axis moves a point at lever l by 2/3 · σ² l², σ² being its trace.
constexpr double kAcross = 2.0 / 3.0;

// Sums along a path from which the position's variance at its end follows.
struct PathSums {
  double position_m2 = 0.0;
  double rotation_rad2 = 0.0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();  // Σ σ² p of the rotations and where they act
  double second = 0.0;                              // Σ σ² |p|²
  double way_m = 0.0;
  int hops = 0;

  double PositionVariance(const Eigen::Vector3d& p) const {
    const double levers = rotation_rad2 * p.squaredNorm() - 2.0 * p.dot(first) + second;
    return position_m2 + kAcross * std::max(0.0, levers);
  }
};

}  // namespace

absl::Status DriftOptions::Validate() const {
  OptionChecks checks("drift options");
  checks.InRange("drift_m", drift_m, 0.0, 10.0);
  checks.InRange("drift_rad", drift_rad, 0.0, 10.0);
  return checks.status();
}

PathUncertainties::PathUncertainties(std::span<const Pose> T_map_scan,
                                     std::span<const GraphEdge> edges,
                                     const DriftOptions& options) {
  for (const Pose& T : T_map_scan) positions_.push_back(T.translation());
  begin_.assign(positions_.size() + 1, 0);
  const auto usable = [](const GraphEdge& edge) { return edge.information.allFinite(); };
  for (const GraphEdge& edge : edges) {
    if (!usable(edge)) continue;
    ++begin_[edge.i + 1];
    ++begin_[edge.j + 1];
  }
  for (std::size_t i = 0; i < positions_.size(); ++i) begin_[i + 1] += begin_[i];
  half_edges_.resize(begin_.back());
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  for (const GraphEdge& edge : edges) {
    if (!usable(edge)) continue;
    const Matrix6d information = edge.information + kLeastInformation * Matrix6d::Identity();
    const Matrix6d covariance = information.ldlt().solve(Matrix6d::Identity());
    const double length = (positions_[edge.i] - positions_[edge.j]).norm();
    const HalfEdge half{edge.j,
                        std::max(0.0, covariance.bottomRightCorner<3, 3>().trace()) +
                            options.drift_m * options.drift_m * length,
                        std::max(0.0, covariance.topLeftCorner<3, 3>().trace()) +
                            options.drift_rad * options.drift_rad * length,
                        length};
    half_edges_[next[edge.i]++] = half;
    half_edges_[next[edge.j]] = half;
    half_edges_[next[edge.j]++].to = edge.i;
  }
}

std::vector<PathUncertainty> PathUncertainties::From(std::size_t node) const {
  std::vector<PathUncertainty> answers(size());
  std::vector<double> best(size(), std::numeric_limits<double>::infinity());
  std::vector<PathSums> sums(size());
  using Entry = std::pair<double, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  best[node] = 0.0;
  open.emplace(0.0, node);
  while (!open.empty()) {
    const auto [cost, at] = open.top();
    open.pop();
    if (answers[at].connected) continue;
    const PathSums& here = sums[at];
    const Eigen::Vector3d p = positions_[at] - positions_[node];
    answers[at] = {true,
                   std::sqrt(here.PositionVariance(p)),
                   std::sqrt(here.rotation_rad2),
                   here.way_m,
                   here.hops};
    for (std::size_t e = begin_[at]; e < begin_[at + 1]; ++e) {
      const HalfEdge& edge = half_edges_[e];
      const double reached =
          cost + edge.position_m2 + kAcross * kLeverM * kLeverM * edge.rotation_rad2;
      if (!(reached < best[edge.to])) continue;
      best[edge.to] = reached;
      const Eigen::Vector3d q = positions_[edge.to] - positions_[node];
      PathSums& there = sums[edge.to];
      there = here;
      there.position_m2 += edge.position_m2;
      there.rotation_rad2 += edge.rotation_rad2;
      there.first += edge.rotation_rad2 * q;
      there.second += edge.rotation_rad2 * q.squaredNorm();
      there.way_m += edge.length_m;
      ++there.hops;
      open.emplace(reached, edge.to);
    }
  }
  return answers;
}

std::vector<std::size_t> PathUncertainties::Parts() const {
  std::vector<std::size_t> part(size(), size());
  std::vector<std::size_t> open;
  for (std::size_t first = 0; first < size(); ++first) {
    if (part[first] != size()) continue;
    part[first] = first;
    open = {first};
    while (!open.empty()) {
      const std::size_t at = open.back();
      open.pop_back();
      for (std::size_t e = begin_[at]; e < begin_[at + 1]; ++e) {
        if (part[half_edges_[e].to] != size()) continue;
        part[half_edges_[e].to] = first;
        open.push_back(half_edges_[e].to);
      }
    }
  }
  return part;
}

}  // namespace strata
