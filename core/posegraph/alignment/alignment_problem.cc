#include "core/posegraph/alignment/alignment_problem.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/registration/neighbours.h"

namespace strata {

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
