#include "core/posegraph/closures/pooling.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/posegraph/information.h"

namespace strata {
namespace {

// How far registration may have carried a pool's last scan away from its first, a step.
constexpr double kStepSigmaM = 0.01;
constexpr double kStepSigmaRad = 0.001;

// The last pool that each node is in: the one it is first in, if it is shared.
std::vector<std::size_t> PoolOfNodes(std::span<const Pool> pools, std::size_t nodes) {
  std::vector<std::size_t> pool_of(nodes, 0);
  for (std::size_t p = 0; p < pools.size(); ++p) {
    for (const std::size_t node : pools[p].nodes) pool_of[node] = p;
  }
  return pool_of;
}

Matrix6d Adjoint(const Pose& T) {
  Eigen::Matrix3d cross;
  const Eigen::Vector3d& t = T.translation();
  cross << 0.0, -t.z(), t.y(), t.z(), 0.0, -t.x(), -t.y(), t.x(), 0.0;
  Matrix6d adjoint = Matrix6d::Zero();
  adjoint.topLeftCorner<3, 3>() = T.linear();
  adjoint.bottomRightCorner<3, 3>() = T.linear();
  adjoint.bottomLeftCorner<3, 3>() = cross * T.linear();
  return adjoint;
}

// What is known of T_i_j, of T_i_k = T_i_j · T_j_k.
Matrix6d Carried(const Matrix6d& information, const Pose& T_j_k) {
  const Matrix6d adjoint = Adjoint(T_j_k);
  const Matrix6d carried = adjoint.transpose() * information * adjoint;
  return 0.5 * (carried + carried.transpose());
}

RelativePoseTerm SharedScanTerm(std::size_t a,
                                std::size_t b,
                                std::size_t steps,
                                const Pose& T_a_b) {
  RelativePoseTerm term;
  term.i = a;
  term.j = b;
  term.T_i_j = T_a_b;
  const double count = static_cast<double>(std::max<std::size_t>(1, steps));
  term.information =
      IsotropicInformation(kStepSigmaRad * std::sqrt(count), kStepSigmaM * std::sqrt(count));
  return term;
}

}  // namespace

std::vector<Pool> MakePools(std::span<const std::vector<std::size_t>> trajectories,
                            std::size_t size) {
  std::vector<Pool> pools;
  for (const std::vector<std::size_t>& trajectory : trajectories) {
    for (std::size_t first = 0; first < trajectory.size(); first += size - 1) {
      if (first > 0 && first + 1 == trajectory.size()) break;  // the one before ends with it
      const std::size_t last = std::min(first + size, trajectory.size());
      pools.push_back({{trajectory.begin() + static_cast<std::ptrdiff_t>(first),
                        trajectory.begin() + static_cast<std::ptrdiff_t>(last)}});
    }
  }
  return pools;
}

PoseGraphProblem PoolGraph(const PoseGraphProblem& graph, std::span<const Pool> pools) {
  const std::vector<std::size_t> pool_of = PoolOfNodes(pools, graph.T_map_scan.size());
  const auto base = [&](std::size_t pool) -> const Pose& {
    return graph.T_map_scan[pools[pool].nodes.front()];
  };
  const auto T_pool_scan = [&](std::size_t node) {
    return base(pool_of[node]).inverse() * graph.T_map_scan[node];
  };
  PoseGraphProblem pooled;
  for (std::size_t p = 0; p < pools.size(); ++p) {
    pooled.T_map_scan.push_back(base(p));
    bool fixed = false;
    for (const std::size_t node : pools[p].nodes) {
      fixed = fixed || (!graph.fixed.empty() && graph.fixed[node]);
    }
    pooled.fixed.push_back(fixed);
    const std::size_t last = pools[p].nodes.back();
    if (pool_of[last] == p) continue;
    pooled.relative.push_back(SharedScanTerm(
        p, pool_of[last], pools[p].nodes.size() - 1, base(p).inverse() * base(pool_of[last])));
  }
  for (const RelativePoseTerm& term : graph.relative) {
    const std::size_t a = pool_of[term.i];
    const std::size_t b = pool_of[term.j];
    if (a == b) continue;
    const Pose T_scan_pool = T_pool_scan(term.j).inverse();
    pooled.relative.push_back({a,
                               b,
                               Normalized(T_pool_scan(term.i) * term.T_i_j * T_scan_pool),
                               Carried(term.information, T_scan_pool),
                               term.may_be_false});
  }
  for (const PriorTerm& prior : graph.priors) {
    const Pose T_scan_pool = T_pool_scan(prior.i).inverse();
    pooled.priors.push_back({pool_of[prior.i],
                             Normalized(prior.T_map_scan * T_scan_pool),
                             Carried(prior.information, T_scan_pool)});
  }
  return pooled;
}

std::vector<Pose> UnpoolPoses(std::span<const Pool> pools,
                              std::span<const Pose> T_map_pool,
                              std::span<const Pose> T_map_scan_before) {
  std::vector<Pose> poses(T_map_scan_before.begin(), T_map_scan_before.end());
  for (std::size_t p = 0; p < pools.size(); ++p) {
    const Pose correction = T_map_pool[p] * T_map_scan_before[pools[p].nodes.front()].inverse();
    for (const std::size_t node : pools[p].nodes) {
      poses[node] = Normalized(correction * T_map_scan_before[node]);
    }
  }
  return poses;
}

}  // namespace strata
