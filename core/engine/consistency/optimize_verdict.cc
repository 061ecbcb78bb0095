#include "core/engine/consistency/optimize_verdict.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

#include "core/common/disjoint_sets.h"
#include "core/common/status.h"
#include "core/engine/consistency/contradicted_joins.h"

namespace strata {
namespace {

// Of steps that may be loose, and of pairs that may be contradicted; a few may always be.
constexpr double kMostDoubtful = 0.25;
constexpr std::size_t kFew = 4;
// Of absolute poses: walls reflect GPS for a while, not for most of a drive.
constexpr double kMostFalse = 0.5;
constexpr std::size_t kNamed = 3;
// Scans that are looked at closely, spread over the map, and those of every robot.
constexpr std::size_t kMostLookedAt = 60;
constexpr std::size_t kLeastLookedAt = 6;
// Of the pairs of two robots, or of one: a small part of a large map may be wrong as a whole.
constexpr double kMostOfTwo = 0.5;
constexpr std::size_t kFewOfTwo = 2;
// From this share of pairs on a person should look at them.
constexpr double kWorthALook = 0.1;
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

// Spread over the map and over every trajectory, ascending.
std::set<std::size_t> NodesToLookAt(const GraphWorld& world) {
  std::set<std::size_t> nodes;
  const auto stride = [](std::size_t size, std::size_t count) {
    return (size + count - 1) / count;
  };
  for (std::size_t k = 0; k < world.size(); k += stride(world.size(), kMostLookedAt)) {
    nodes.insert(k);
  }
  for (const std::vector<std::size_t>& trajectory : world.Trajectories()) {
    for (std::size_t k = 0; k < trajectory.size(); k += stride(trajectory.size(), kLeastLookedAt)) {
      nodes.insert(trajectory[k]);
    }
  }
  return nodes;
}

// The scan before on the trajectory, and one of another pass. Those of two parts are where robots
// said that they are, for which nothing here answers.
std::set<NodePair> PairsToCompare(const GraphWorld& world, const AlignmentResult& result) {
  std::set<NodePair> pairs;
  const auto add = [&](std::size_t a, std::size_t b) {
    if (result.parts.empty() || result.parts[a] == result.parts[b]) pairs.insert(std::minmax(a, b));
  };
  for (const std::size_t node : NodesToLookAt(world)) {
    const auto& [t, index] = world.PlaceOf(node);
    if (index > 0) add(world.Trajectories()[t][index - 1], node);
    const std::optional<std::size_t> other = NearestOfAnotherPass(world, result.T_map_scan, node);
    if (other.has_value()) add(*other, node);
  }
  return pairs;
}

bool IsTooMany(std::size_t doubtful,
               std::size_t all,
               double most = kMostDoubtful,
               std::size_t few = kFew) {
  return doubtful > few && static_cast<double>(doubtful) > most * static_cast<double>(all);
}

absl::Status Compare(const GraphWorld& world,
                     ScanViews& views,
                     const AlignmentResult& result,
                     OptimizeVerdict& verdict) {
  struct Counts {
    std::size_t compared = 0, contradicted = 0;
  };
  std::map<NodePair, Counts> of_two;  // trajectories
  for (const NodePair& pair : PairsToCompare(world, result)) {
    const absl::StatusOr<double> contradiction = ContradictionAt(views, result.T_map_scan, pair);
    if (absl::IsDataLoss(contradiction.status())) continue;
    STRATA_RETURN_IF_ERROR(contradiction.status());
    Counts& counts = of_two[std::minmax(world.PlaceOf(pair.first).trajectory,
                                        world.PlaceOf(pair.second).trajectory)];
    ++counts.compared;
    if (*contradiction <= kMuchContradiction) continue;
    ++counts.contradicted;
    verdict.contradicted_pairs.push_back(pair);
  }
  const auto name = [&](std::size_t t) { return world.id(world.Trajectories()[t][0]).trajectory; };
  for (const auto& [two, counts] : of_two) {
    verdict.compared += counts.compared;
    if (!IsTooMany(counts.contradicted, counts.compared, kMostOfTwo, kFewOfTwo)) continue;
    verdict.at_odds.push_back(two.first == two.second
                                  ? name(two.first)
                                  : absl::StrCat(name(two.first), " and ", name(two.second)));
  }
  return absl::OkStatus();
}

// But for the largest, and those that loose steps lead to from there.
void FindParts(const GraphWorld& world,
               const std::vector<std::size_t>& parts,
               const std::set<ScanNumber>& damaged,
               OptimizeVerdict& verdict) {
  DisjointSets tied;
  for (const auto& [before, node] : verdict.loose_steps) tied.Join(parts[before], parts[node]);
  std::map<std::size_t, std::vector<std::size_t>> nodes;
  for (std::size_t k = 0; k < parts.size(); ++k) {
    if (!damaged.contains(world.number(k))) nodes[tied.Root(parts[k])].push_back(k);
  }
  std::vector<std::vector<std::size_t>> by_size;
  for (auto& [part, members] : nodes) by_size.push_back(std::move(members));
  std::ranges::stable_sort(by_size, std::greater(), &std::vector<std::size_t>::size);
  for (std::size_t k = 1; k < by_size.size(); ++k) {
    verdict.apart.emplace_back(by_size[k][0], by_size[k].size());
  }
}

void FindDoubtfulSteps(const GraphWorld& world,
                       const AlignmentResult& result,
                       const std::set<ScanNumber>& damaged,
                       OptimizeVerdict& verdict) {
  for (std::vector<std::size_t> trajectory : world.Trajectories()) {
    std::erase_if(trajectory, [&](std::size_t k) { return damaged.contains(world.number(k)); });
    for (std::size_t k = 1; k < trajectory.size(); ++k) {
      ++verdict.steps;
      const std::size_t before = trajectory[k - 1];
      const std::size_t node = trajectory[k];
      if (result.parts[before] != result.parts[node]) {
        verdict.loose_steps.emplace_back(before, node);
      } else if (std::ranges::binary_search(result.sliding, node)) {
        verdict.sliding_steps.emplace_back(before, node);
      }
    }
  }
}

bool PriorsContradict(const OptimizeVerdict& verdict) {
  return IsTooMany(verdict.priors_rejected, verdict.priors, kMostFalse);
}

// "robot/7, robot/8, …": the second scan of each pair, or both, "robot/6 and robot/7, …".
std::string NamesOf(const GraphWorld& world,
                    const std::vector<NodePair>& pairs,
                    bool both = false) {
  std::string names;
  for (std::size_t k = 0; k < std::min(kNamed, pairs.size()); ++k) {
    absl::StrAppend(&names, k == 0 ? "" : ", ");
    if (both) absl::StrAppend(&names, world.id(pairs[k].first).ToString(), " and ");
    absl::StrAppend(&names, world.id(pairs[k].second).ToString());
  }
  return absl::StrCat(names, pairs.size() > kNamed ? ", …" : "");
}

std::string StepsMessage(const GraphWorld& world, const OptimizeVerdict& verdict) {
  const auto& loose = verdict.loose_steps;
  const auto& sliding = verdict.sliding_steps;
  std::string message =
      loose.empty()
          ? absl::StrFormat("All %d steps from scan to scan are measured", verdict.steps)
          : absl::StrFormat("%d of %d steps from scan to scan are the robot's word alone (to %s)",
                            loose.size(),
                            verdict.steps,
                            NamesOf(world, loose));
  if (sliding.empty()) return message;
  return absl::StrFormat(
      "%s; %d may slide along what scans see, and are as good as the robot's word (to %s)",
      message,
      sliding.size(),
      NamesOf(world, sliding));
}

// Whether so many pairs are contradicted that it is more than what moves, or is of glass.
bool ArePairsDoubtful(const OptimizeVerdict& verdict) {
  return !verdict.contradicted_pairs.empty() &&
         static_cast<double>(verdict.contradicted_pairs.size()) >=
             kWorthALook * static_cast<double>(verdict.compared);
}

std::string PairsMessage(const GraphWorld& world, const OptimizeVerdict& verdict) {
  const std::vector<NodePair>& pairs = verdict.contradicted_pairs;
  if (pairs.empty()) return "";
  std::string message =
      absl::StrFormat("; in %d of %d pairs one scan looks through what the other saw",
                      pairs.size(),
                      verdict.compared);
  if (verdict.at_odds.empty() && ArePairsDoubtful(verdict)) {
    absl::StrAppend(&message, " (", NamesOf(world, pairs, true), ")");
  }
  for (std::size_t k = 0; k < std::min(kNamed, verdict.at_odds.size()); ++k) {
    absl::StrAppend(&message, k == 0 ? ", most of " : "; of ", verdict.at_odds[k]);
  }
  return message;
}

std::string PartsMessage(const GraphWorld& world, const OptimizeVerdict& verdict) {
  if (verdict.apart.empty()) return "";
  std::string message = "Nothing joins ";
  for (std::size_t k = 0; k < std::min(kNamed, verdict.apart.size()); ++k) {
    const auto& [first, count] = verdict.apart[k];
    absl::StrAppend(&message, k == 0 ? "" : ", ", world.id(first).ToString());
    if (count > 1) absl::StrAppend(&message, " (with ", count - 1, " more)");
  }
  return absl::StrCat(message,
                      verdict.apart.size() > kNamed ? ", …" : "",
                      " to the rest: they are where their robot",
                      verdict.priors > 0 ? " or absolute poses say" : " said",
                      ", until scans of places in common or posegraph add-constraint tell more. ");
}

std::string PriorsMessage(const OptimizeVerdict& verdict) {
  if (verdict.priors_rejected == 0) return "";
  return absl::StrFormat("; %d of %d absolute poses do not fit what scans see",
                         verdict.priors_rejected,
                         verdict.priors);
}

std::string Meaning(const OptimizeVerdict& verdict, AlignmentTermination termination) {
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
  if (ArePairsDoubtful(verdict)) return "Usable; look at these pairs.";
  if (termination != AlignmentTermination::kSettled) return "Usable; run it again for the rest.";
  return absl::StrCat("Good",
                      verdict.apart.empty() ? "" : " within each part",
                      verdict.sliding_steps.empty() ? "" : " but for what may slide",
                      ".");
}

}  // namespace

absl::StatusOr<OptimizeVerdict> VerdictOn(const GraphWorld& world,
                                          ScanViews& views,
                                          const AlignmentResult& result,
                                          const DamagedScans& damaged) {
  OptimizeVerdict verdict;
  if (!result.parts.empty()) {
    FindDoubtfulSteps(world, result, damaged.Scans(), verdict);
    FindParts(world, result.parts, damaged.Scans(), verdict);
  }
  STRATA_RETURN_IF_ERROR(Compare(world, views, result, verdict));
  verdict.priors = result.priors;
  verdict.priors_rejected = result.rejected_priors;
  // What a step that nothing holds leads to swings for as long as rounds go on.
  const bool swings =
      result.termination != AlignmentTermination::kSettled && !verdict.loose_steps.empty();
  verdict.is_sound = !PriorsContradict(verdict) &&
                     !IsTooMany(verdict.loose_steps.size(), verdict.steps) &&
                     !IsTooMany(verdict.contradicted_pairs.size(), verdict.compared) &&
                     verdict.at_odds.empty() && !swings;
  verdict.message = absl::StrCat(StepsMessage(world, verdict),
                                 PairsMessage(world, verdict),
                                 PriorsMessage(verdict),
                                 ". ",
                                 PartsMessage(world, verdict),
                                 Meaning(verdict, result.termination));
  return verdict;
}

}  // namespace strata
