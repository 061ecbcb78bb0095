#include "core/posegraph/closures/closure_consistency.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/option_checks.h"
#include "core/common/status.h"
#include "core/registration/place_match.h"

namespace strata {
namespace {

constexpr double kHoldsM = 0.5;
constexpr double kHoldsRad = 0.05;
constexpr double kStoreysM = 6.0;  // one, or two low ones
// Within one part: what is moved up or down by a storey at least, and not by half as much aside.
constexpr double kStoreyM = 1.5;
constexpr double kAsideShare = 0.5;
// Believed within so many σ of the graph; and, where as many closures of half its σ at least show
// how many σ the graph errs by in fact, within so many times that.
constexpr double kStoreySigmas = 1.2;
constexpr std::size_t kEnoughClosures = 8;
constexpr double kComparableShare = 0.5;
constexpr double kUsualErrors = 5.0;

// Consistency as a graph over the closures of one group.
class Cliques {
 public:
  explicit Cliques(std::size_t size) : adjacent_(size, std::vector<bool>(size, false)) {}
  void Join(std::size_t a, std::size_t b) { adjacent_[a][b] = adjacent_[b][a] = true; }
  int Degree(std::size_t a) const {
    return static_cast<int>(std::count(adjacent_[a].begin(), adjacent_[a].end(), true));
  }

  // Grows a clique from every member, taking the candidate of highest degree each time.
  std::vector<std::size_t> Largest() const {
    std::vector<std::size_t> order(adjacent_.size());
    for (std::size_t a = 0; a < order.size(); ++a) order[a] = a;
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return Degree(a) > Degree(b);
    });
    std::vector<std::size_t> best;
    for (const std::size_t seed : order) {
      if (static_cast<std::size_t>(Degree(seed)) + 1 <= best.size()) break;
      std::vector<std::size_t> clique = {seed};
      for (const std::size_t a : order) {
        if (std::all_of(
                clique.begin(), clique.end(), [&](std::size_t b) { return adjacent_[a][b]; })) {
          clique.push_back(a);
        }
      }
      if (clique.size() > best.size()) best = std::move(clique);
    }
    return best;
  }

 private:
  std::vector<std::vector<bool>> adjacent_;
};

// What the graph knows seen from one end of a closure.
using Known = std::vector<PathUncertainty>;

class ConsistencyCheck {
 public:
  ConsistencyCheck(std::span<const Pose> T_map_scan,
                   std::span<const GraphEdge> edges,
                   std::span<const Closure> closures,
                   const ClosureConsistencyOptions& options)
      : poses_(T_map_scan), closures_(closures), options_(options) {
    const PathUncertainties graph(T_map_scan, edges, options.drift);
    part_ = graph.Parts();
    std::vector<std::size_t> ends;
    for (const Closure& c : closures) ends.insert(ends.end(), {c.i, c.j});
    for (const std::size_t node : ends) {
      if (known_.contains(node)) continue;
      Known& kept = known_[node];
      const Known all = graph.From(node);
      for (const std::size_t other : ends) kept.push_back(all[other]);
    }
    for (std::size_t c = 0; c < closures.size(); ++c) {
      groups_[std::minmax({part_[closures[c].i], part_[closures[c].j]})].push_back(c);
    }
  }

  ConsistentClosureSet Run() const {
    ConsistentClosureSet set;
    set.support.assign(closures_.size(), 0);
    for (const auto& [parts, members] : groups_) {
      const bool one_part = parts.first == parts.second;
      const bool is_as_said =
          !one_part && std::ranges::any_of(members, [this](std::size_t c) { return IsAsSaid(c); });
      std::vector<std::size_t> believable;
      for (const std::size_t c : members) {
        const bool may_be_true = one_part     ? AgreesWithGraph(c) && !IsOnOtherStorey(c, members)
                                 : is_as_said ? IsAsSaid(c)
                                              : !IsStoreyOff(c);
        if (may_be_true) believable.push_back(c);
      }
      Cliques cliques(believable.size());
      for (std::size_t a = 0; a < believable.size(); ++a) {
        for (std::size_t b = 0; b < a; ++b) {
          if (Consistent(believable[a], believable[b])) cliques.Join(a, b);
        }
      }
      for (std::size_t a = 0; a < believable.size(); ++a) {
        set.support[believable[a]] = cliques.Degree(a);
      }
      const std::vector<std::size_t> largest = cliques.Largest();
      if (!one_part && !is_as_said && !AreSpread(believable, largest)) continue;
      for (const std::size_t a : largest) set.kept.push_back(believable[a]);
    }
    std::sort(set.kept.begin(), set.kept.end());
    return set;
  }

 private:
  // `end`: 2c for closures_[c].i, 2c + 1 for its j.
  const PathUncertainty& Path(std::size_t from_end, std::size_t to_end) const {
    const Closure& c = closures_[from_end / 2];
    return known_.at(from_end % 2 == 0 ? c.i : c.j)[to_end];
  }

  // Whether a loop that comes back with this error, though it should with none, may be true.
  bool Within(const Pose& error, double variance_m2, double variance_rad2) const {
    return error.translation().norm() <= options_.max_sigmas * std::sqrt(variance_m2) &&
           RotationAngleRad(error) <= options_.max_sigmas * std::sqrt(variance_rad2);
  }

  // Whether these closures between two parts are of enough scans, and far enough apart.
  bool AreSpread(const std::vector<std::size_t>& believable,
                 const std::vector<std::size_t>& chosen) const {
    std::map<std::size_t, std::set<std::size_t>> scans;  // by part
    for (const std::size_t a : chosen) {
      const Closure& closure = closures_[believable[a]];
      scans[part_[closure.i]].insert(closure.i);
      scans[part_[closure.j]].insert(closure.j);
    }
    return std::ranges::all_of(scans, [this](const auto& part) {
      return part.second.size() >= static_cast<std::size_t>(options_.min_between_parts) &&
             ExtentOf(part.second) >= options_.min_spread_m;
    });
  }

  double ExtentOf(const std::set<std::size_t>& scans) const {
    double extent = 0.0;
    for (const std::size_t a : scans) {
      for (const std::size_t b : scans) {
        extent = std::max(extent, (poses_[a].translation() - poses_[b].translation()).norm());
      }
    }
    return extent;
  }

  // The frames of the two parts say about the same.
  bool IsAsSaid(std::size_t c) const {
    const Closure& closure = closures_[c];
    return IsWithin(poses_[closure.i] * closure.T_i_j, SaidHypothesis(poses_[closure.j]));
  }

  // They say so but for a height of one storey or two, and storeys look alike.
  bool IsStoreyOff(std::size_t c) const {
    const Closure& closure = closures_[c];
    PlaceHypothesis window = SaidHypothesis(poses_[closure.j]);
    window.height_range_m = kStoreysM;
    return !IsAsSaid(c) && IsWithin(poses_[closure.i] * closure.T_i_j, window);
  }

  bool AgreesWithGraph(std::size_t c) const {
    const Closure& closure = closures_[c];
    const PathUncertainty& path = Path(2 * c, 2 * c + 1);
    const Pose T_i_j = poses_[closure.i].inverse() * poses_[closure.j];
    return Within(closure.T_i_j.inverse() * T_i_j,
                  path.sigma_m * path.sigma_m + closure.sigma_m * closure.sigma_m,
                  path.sigma_rad * path.sigma_rad + closure.sigma_rad * closure.sigma_rad);
  }

  // From where the closure has its j to where the graph has it, in the map's frame.
  Eigen::Vector3d ErrorOf(std::size_t c) const {
    const Closure& closure = closures_[c];
    return poses_[closure.j].translation() - (poses_[closure.i] * closure.T_i_j).translation();
  }

  double SigmaOf(std::size_t c) const {
    return std::hypot(Path(2 * c, 2 * c + 1).sigma_m, closures_[c].sigma_m);
  }

  // Moved by a storey and hardly aside: storeys look alike, and nothing contradicts it but how well
  // the graph is known.
  bool IsOnOtherStorey(std::size_t c, const std::vector<std::size_t>& members) const {
    const Eigen::Vector3d error = ErrorOf(c);
    const double up_m = std::abs(error.z());
    return up_m >= kStoreyM && error.head<2>().norm() <= kAsideShare * up_m &&
           up_m > StoreySigmas(SigmaOf(c), members) * SigmaOf(c);
  }

  // How many σ a height may be off that the graph knows to `sigma_m`. What its σ allows for is
  // seldom met: on a ramp with columns around the graph errs by a hundredth of it.
  double StoreySigmas(double sigma_m, const std::vector<std::size_t>& members) const {
    std::vector<double> errors;  // in σ
    for (const std::size_t c : members) {
      const double known_m = SigmaOf(c);
      if (known_m >= kComparableShare * sigma_m) errors.push_back(ErrorOf(c).norm() / known_m);
    }
    if (errors.size() < kEnoughClosures) return kStoreySigmas;
    const auto usual = errors.begin() + kEnoughClosures - 1;
    std::nth_element(errors.begin(), usual, errors.end());
    return std::min(kStoreySigmas, kUsualErrors * *usual);
  }

  // Round the loop i_a → j_a → j_b → i_b → i_a, each step known to its own σ. A rotation's error
  // moves the end by its lever: the paths carry their own, the closures that of the other's way.
  bool Consistent(std::size_t a, std::size_t b) const {
    const Closure& first = closures_[a];
    const Closure& second = closures_[b];
    // Within one part the ends may lie crosswise.
    const PathUncertainty straight = Path(2 * a, 2 * b);
    const PathUncertainty crossed = Path(2 * a, 2 * b + 1);
    const bool cross =
        !straight.connected || (crossed.connected && crossed.sigma_m < straight.sigma_m);
    const std::size_t i = cross ? second.j : second.i;
    const std::size_t j = cross ? second.i : second.j;
    const Pose T_second = cross ? second.T_i_j.inverse() : second.T_i_j;
    const PathUncertainty& at_i = cross ? crossed : straight;
    const PathUncertainty& at_j = Path(2 * a + 1, 2 * b + (cross ? 0 : 1));
    if (!at_i.connected || !at_j.connected) return false;
    const Pose T_i = poses_[first.i].inverse() * poses_[i];
    const Pose T_j = poses_[first.j].inverse() * poses_[j];
    const double lever2 =
        std::min(T_i.translation().squaredNorm(), T_j.translation().squaredNorm());
    const double reach2 = T_second.translation().squaredNorm();
    const double closures_m2 = first.sigma_m * first.sigma_m + second.sigma_m * second.sigma_m;
    const double closures_rad2 =
        first.sigma_rad * first.sigma_rad + second.sigma_rad * second.sigma_rad;
    const double paths_m2 = at_i.sigma_m * at_i.sigma_m + at_j.sigma_m * at_j.sigma_m;
    const double paths_rad2 = at_i.sigma_rad * at_i.sigma_rad + at_j.sigma_rad * at_j.sigma_rad;
    return Within((first.T_i_j * T_j).inverse() * (T_i * T_second),
                  closures_m2 + lever2 * closures_rad2 + paths_m2 + reach2 * paths_rad2,
                  closures_rad2 + paths_rad2);
  }

  std::span<const Pose> poses_;
  std::span<const Closure> closures_;
  const ClosureConsistencyOptions& options_;
  std::vector<std::size_t> part_;       // of each node
  std::map<std::size_t, Known> known_;  // of each node that ends a closure: to all ends
  std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> groups_;
};

absl::Status CheckInput(std::span<const Pose> poses,
                        std::span<const GraphEdge> edges,
                        std::span<const Closure> closures) {
  for (std::size_t i = 0; i < poses.size(); ++i) {
    STRATA_RETURN_IF_ERROR(Annotate(ValidatePose(poses[i]), absl::StrCat("pose ", i)));
  }
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if (edges[e].i < poses.size() && edges[e].j < poses.size() && edges[e].i != edges[e].j)
      continue;
    return absl::InvalidArgumentError(absl::StrCat("graph edge ",
                                                   e,
                                                   " joins ",
                                                   edges[e].i,
                                                   " and ",
                                                   edges[e].j,
                                                   ", must be two different nodes of ",
                                                   poses.size()));
  }
  for (std::size_t c = 0; c < closures.size(); ++c) {
    const Closure& closure = closures[c];
    const std::string name = absl::StrCat("closure ", c);
    STRATA_RETURN_IF_ERROR(Annotate(ValidatePose(closure.T_i_j), name));
    if (closure.i >= poses.size() || closure.j >= poses.size() || closure.i == closure.j) {
      return absl::InvalidArgumentError(absl::StrCat(name,
                                                     " joins ",
                                                     closure.i,
                                                     " and ",
                                                     closure.j,
                                                     ", must be two different nodes of ",
                                                     poses.size()));
    }
    if (!(closure.sigma_m > 0.0 && closure.sigma_rad > 0.0 && std::isfinite(closure.sigma_m) &&
          std::isfinite(closure.sigma_rad))) {
      return absl::InvalidArgumentError(absl::StrCat(name,
                                                     " has sigma_m ",
                                                     closure.sigma_m,
                                                     " and sigma_rad ",
                                                     closure.sigma_rad,
                                                     ", both must be finite and above 0"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

bool ClosureHolds(const Pose& T_i_j, const Pose& T_map_i, const Pose& T_map_j) {
  const Pose difference = T_i_j.inverse() * T_map_i.inverse() * T_map_j;
  return difference.translation().norm() <= kHoldsM && RotationAngleRad(difference) <= kHoldsRad;
}

absl::Status ClosureConsistencyOptions::Validate() const {
  OptionChecks checks("closure consistency options");
  checks.InRange("max_sigmas", max_sigmas, 1e-6, 100.0);
  checks.InRange("min_between_parts", min_between_parts, 1, 1000);
  checks.InRange("min_spread_m", min_spread_m, 0.0, 1000.0);
  STRATA_RETURN_IF_ERROR(checks.status());
  return drift.Validate();
}

absl::StatusOr<ConsistentClosureSet> ConsistentClosures(std::span<const Pose> T_map_scan,
                                                        std::span<const GraphEdge> edges,
                                                        std::span<const Closure> closures,
                                                        const ClosureConsistencyOptions& options) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  STRATA_RETURN_IF_ERROR(CheckInput(T_map_scan, edges, closures));
  return ConsistencyCheck(T_map_scan, edges, closures, options).Run();
}

}  // namespace strata
