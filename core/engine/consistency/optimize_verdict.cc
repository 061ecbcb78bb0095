#include "core/engine/consistency/optimize_verdict.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "core/common/status.h"
#include "core/registration/place_match.h"

namespace strata {
namespace {

// Of steps that may be loose, and of pairs that may be contradicted; a few may always be.
constexpr double kMostDoubtful = 0.25;
constexpr std::size_t kFew = 4;
// Of absolute poses: walls reflect GPS for a while, not for most of a drive.
constexpr double kMostFalse = 0.5;
constexpr std::size_t kNamed = 3;
// Scans that are looked at closely, spread over the map.
constexpr std::size_t kMostLookedAt = 60;
// People and cars pass; a wall that another scan looked through does not.
constexpr double kMuchContradiction = 0.1;
// Scans of other passes as near as this see the same.
constexpr double kNearM = 5.0;
constexpr double kSameStoreyM = 1.0;

using NodePair = std::pair<std::size_t, std::size_t>;

std::optional<std::size_t> NearestOfAnotherPass(const GraphWorld& world,
                                                const std::vector<Pose>& T_map_scan,
                                                std::size_t node) {
  std::optional<std::size_t> nearest;
  double least_m = kNearM;
  for (std::size_t other = 0; other < T_map_scan.size(); ++other) {
    if (world.SamePass(node, other)) continue;
    const Eigen::Vector3d way = T_map_scan[other].translation() - T_map_scan[node].translation();
    if (std::abs(way.z()) > kSameStoreyM || way.norm() >= least_m) continue;
    least_m = way.norm();
    nearest = other;
  }
  return nearest;
}

// The scan before on the trajectory, and one of another pass, of scans spread over the map.
std::set<NodePair> PairsToCompare(const GraphWorld& world, const std::vector<Pose>& T_map_scan) {
  std::set<NodePair> pairs;
  const std::size_t stride = (world.size() + kMostLookedAt - 1) / kMostLookedAt;
  for (std::size_t node = 0; node < world.size(); node += stride) {
    const auto& [t, index] = world.PlaceOf(node);
    if (index > 0) pairs.insert(std::minmax(world.Trajectories()[t][index - 1], node));
    const std::optional<std::size_t> other = NearestOfAnotherPass(world, T_map_scan, node);
    if (other.has_value()) pairs.insert(std::minmax(*other, node));
  }
  return pairs;
}

absl::StatusOr<double> ContradictionAt(ScanViews& views,
                                       const std::vector<Pose>& T_map_scan,
                                       const NodePair& pair) {
  STRATA_ASSIGN_OR_RETURN(const auto first, views.Features(pair.first));
  STRATA_ASSIGN_OR_RETURN(const auto second, views.Features(pair.second));
  const auto origin = [&](std::size_t node) {
    return Eigen::Vector3d(views.scan(node).header.sensor_origin.cast<double>());
  };
  return ContradictionOf({first.get(), T_map_scan[pair.first], origin(pair.first)},
                         {second.get(), T_map_scan[pair.second], origin(pair.second)});
}

absl::Status Compare(const GraphWorld& world,
                     ScanViews& views,
                     const std::vector<Pose>& T_map_scan,
                     OptimizeVerdict& verdict) {
  for (const NodePair& pair : PairsToCompare(world, T_map_scan)) {
    const absl::StatusOr<double> contradiction = ContradictionAt(views, T_map_scan, pair);
    if (absl::IsDataLoss(contradiction.status())) continue;
    STRATA_RETURN_IF_ERROR(contradiction.status());
    ++verdict.compared;
    verdict.contradicted += *contradiction > kMuchContradiction ? 1 : 0;
  }
  return absl::OkStatus();
}

void FindLooseSteps(const GraphWorld& world,
                    const std::vector<std::size_t>& parts,
                    const std::set<ScanNumber>& damaged,
                    OptimizeVerdict& verdict) {
  for (std::vector<std::size_t> trajectory : world.Trajectories()) {
    std::erase_if(trajectory, [&](std::size_t k) { return damaged.contains(world.number(k)); });
    for (std::size_t k = 1; k < trajectory.size(); ++k) {
      ++verdict.steps;
      if (parts[trajectory[k - 1]] == parts[trajectory[k]]) continue;
      verdict.loose_steps.push_back(trajectory[k]);
    }
  }
}

bool IsTooMany(std::size_t doubtful, std::size_t all, double most = kMostDoubtful) {
  return doubtful > kFew && static_cast<double>(doubtful) > most * static_cast<double>(all);
}

bool PriorsContradict(const OptimizeVerdict& verdict) {
  return IsTooMany(verdict.priors_rejected, verdict.priors, kMostFalse);
}

std::string StepsMessage(const GraphWorld& world, const OptimizeVerdict& verdict) {
  const auto& loose = verdict.loose_steps;
  if (loose.empty()) {
    return absl::StrFormat("All %d steps from scan to scan are measured", verdict.steps);
  }
  std::string message =
      absl::StrFormat("%d of %d steps from scan to scan are the robot's word alone (to ",
                      loose.size(),
                      verdict.steps);
  for (std::size_t k = 0; k < std::min(kNamed, loose.size()); ++k) {
    absl::StrAppend(&message, k == 0 ? "" : ", ", world.id(loose[k]).ToString());
  }
  return absl::StrCat(message, loose.size() > kNamed ? ", …)" : ")");
}

std::string PairsMessage(const OptimizeVerdict& verdict) {
  if (verdict.contradicted == 0) return "";
  return absl::StrFormat("; in %d of %d pairs one scan looks through what the other saw",
                         verdict.contradicted,
                         verdict.compared);
}

std::string PriorsMessage(const OptimizeVerdict& verdict) {
  if (verdict.priors_rejected == 0) return "";
  return absl::StrFormat("; %d of %d absolute poses do not fit what scans see",
                         verdict.priors_rejected,
                         verdict.priors);
}

absl::string_view Meaning(const OptimizeVerdict& verdict, AlignmentTermination termination) {
  if (PriorsContradict(verdict)) {
    return "Scans and absolute poses (GPS, landmarks) contradict each other: look at the proposal; "
           "job accept applies what the scans say, posegraph disable takes out what is wrong.";
  }
  if (!verdict.is_sound) {
    return "Too little to be applied by itself: scans nearer to each other, poses of this "
           "recording, "
           "or one map for each place would help; job accept applies it.";
  }
  if (!verdict.loose_steps.empty()) return "Usable; look at these steps.";
  return termination == AlignmentTermination::kSettled ? "Good."
                                                       : "Usable; run it again for the rest.";
}

}  // namespace

absl::StatusOr<OptimizeVerdict> VerdictOn(const GraphWorld& world,
                                          ScanViews& views,
                                          const AlignmentResult& result,
                                          const DamagedScans& damaged) {
  OptimizeVerdict verdict;
  if (!result.parts.empty()) FindLooseSteps(world, result.parts, damaged.Scans(), verdict);
  STRATA_RETURN_IF_ERROR(Compare(world, views, result.T_map_scan, verdict));
  verdict.priors = result.priors;
  verdict.priors_rejected = result.rejected_priors;
  verdict.is_sound = !PriorsContradict(verdict) &&
                     !IsTooMany(verdict.loose_steps.size(), verdict.steps) &&
                     !IsTooMany(verdict.contradicted, verdict.compared);
  verdict.message = absl::StrCat(StepsMessage(world, verdict),
                                 PairsMessage(verdict),
                                 PriorsMessage(verdict),
                                 ". ",
                                 Meaning(verdict, result.termination));
  return verdict;
}

}  // namespace strata
