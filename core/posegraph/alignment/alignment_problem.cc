#include "core/posegraph/alignment/alignment_problem.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/registration/neighbours.h"

namespace strata {
namespace {

void MoveZero(const Eigen::Vector3d& zero, Plane& plane) {
  plane.distance -= plane.normal.dot(zero);
}

}  // namespace

absl::Status CheckProblem(const AlignmentProblem& problem) {
  const std::size_t nodes = problem.T_map_scan.size();
  for (const Pose& T_map_scan : problem.T_map_scan) {
    STRATA_RETURN_IF_ERROR(ValidatePose(T_map_scan));
  }
  for (const ScanPair& pair : problem.pairs) {
    if (pair.i >= nodes || pair.j >= nodes || pair.i == pair.j) {
      return absl::InvalidArgumentError(absl::StrCat(
          "pair of scans ", pair.i, " and ", pair.j, ": not two different ones of ", nodes));
    }
  }
  for (const RelativePoseTerm& motion : problem.odometry) {
    if (motion.i >= nodes || motion.j >= nodes || motion.i == motion.j) {
      return absl::InvalidArgumentError(absl::StrCat(
          "odometry from ", motion.i, " to ", motion.j, ": not two different ones of ", nodes));
    }
  }
  for (const std::size_t node : problem.lost) {
    if (node >= nodes) {
      return absl::InvalidArgumentError(absl::StrCat("lost: node ", node, " is none of ", nodes));
    }
  }
  std::vector<int> seen(nodes, 0);
  for (const std::vector<std::size_t>& trajectory : problem.trajectories) {
    for (const std::size_t node : trajectory) {
      if (node >= nodes || ++seen[node] > 1) {
        return absl::InvalidArgumentError(
            absl::StrCat("trajectories: node ", node, " is none or there twice"));
      }
    }
  }
  if (std::find(seen.begin(), seen.end(), 0) != seen.end()) {
    return absl::InvalidArgumentError("trajectories: a node is in none");
  }
  return absl::OkStatus();
}

Eigen::Vector3d FarMiddle(const AlignmentProblem& problem) {
  constexpr double kStepM = 1024.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Pose& T_map_scan : problem.T_map_scan) sum += T_map_scan.translation();
  const double scans = std::max(1.0, static_cast<double>(problem.T_map_scan.size()));
  return kStepM * (sum / (kStepM * scans)).array().round().matrix();
}

void MoveZero(const Eigen::Vector3d& zero, AlignmentProblem& problem) {
  for (Pose& T_map_scan : problem.T_map_scan) T_map_scan.translation() -= zero;
  for (PriorTerm& prior : problem.priors) prior.T_map_scan.translation() -= zero;
  for (ExcludedPlane& excluded : problem.excluded_planes) MoveZero(zero, excluded.plane_map);
}

void MoveZero(const Eigen::Vector3d& zero, AlignmentResult& result) {
  for (Pose& T_map_scan : result.T_map_scan) T_map_scan.translation() -= zero;
  for (SharedPlane& shared : result.planes) MoveZero(zero, shared.plane);
}

void CutBefore(const std::vector<bool>& cut, AlignmentProblem& problem) {
  // Of every node: its trajectory, its place there, and how many cuts are before it.
  struct Place {
    std::size_t trajectory = 0, index = 0, cuts = 0;
  };
  std::vector<Place> places(problem.T_map_scan.size());
  std::vector<std::vector<std::size_t>> trajectories;
  for (std::size_t t = 0; t < problem.trajectories.size(); ++t) {
    Place place{t};
    trajectories.emplace_back();
    for (const std::size_t node : problem.trajectories[t]) {
      if (cut[node] && place.index > 0) {
        ++place.cuts;
        trajectories.emplace_back();
      }
      trajectories.back().push_back(node);
      places[node] = place;
      ++place.index;
    }
  }
  std::erase_if(problem.pairs, [&](const ScanPair& pair) {
    const auto& [i, j] =
        std::minmax(places[pair.i], places[pair.j], [](const auto& a, const auto& b) {
          return a.index < b.index;
        });
    if (i.trajectory != j.trajectory || i.cuts == j.cuts) return false;
    return j.index - i.index == 1 || (pair.measured.has_value() && j.index - i.index <= kOwnPass);
  });
  problem.trajectories = std::move(trajectories);
}

}  // namespace strata
