#include "core/posegraph/alignment.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include <Eigen/Cholesky>

#include "core/common/status.h"
#include "core/registration/registration_target.h"

namespace strata {
namespace {

using NodePair = std::pair<std::size_t, std::size_t>;  // i < j

// A registration made at some relative pose, good until the poses say something else.
struct Measurement {
  Pose T_i_j = Pose::Identity();
  Matrix6d information = Matrix6d::Zero();
  bool good = false;
};

// Within these of where it was registered a pair has the same correspondences.
constexpr double kSamePlaceM = 0.05;
constexpr double kSamePlaceRad = 0.005;

Matrix6d Diagonal(double sigma_rad, double sigma_m) {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(sigma_rad * sigma_rad),
      Eigen::Vector3d::Constant(sigma_m * sigma_m);
  return variances.cwiseInverse().asDiagonal();
}

// (information⁻¹ + extra⁻¹)⁻¹, also for a singular information.
Matrix6d Loosened(const Matrix6d& information, const Matrix6d& extra) {
  const Matrix6d sum = information + extra;
  const Matrix6d loosened = extra - extra * sum.ldlt().solve(extra);
  return 0.5 * (loosened + loosened.transpose());
}

bool Acceptable(Termination termination) {
  return termination == Termination::kConverged || termination == Termination::kMaxIterations ||
         termination == Termination::kDegenerate;
}

NodePair Ordered(std::size_t i, std::size_t j) { return {std::min(i, j), std::max(i, j)}; }

// Whether `found` is what was excluded: the same plane to 3° and 0.2 m where it is seen, and a scan
// in common.
bool IsExcluded(const SharedPlane& found, const ExcludedPlane& excluded) {
  constexpr double kSameCosine = 0.9986;
  constexpr double kSameDistanceM = 0.2;
  if (found.plane.normal.dot(excluded.plane_map.normal) < kSameCosine) return false;
  if (std::abs(found.plane.distance - excluded.plane_map.distance) > kSameDistanceM) return false;
  return std::any_of(found.views.begin(), found.views.end(), [&](const SharedPlane::View& view) {
    return std::find(excluded.nodes.begin(), excluded.nodes.end(), view.scan) !=
           excluded.nodes.end();
  });
}

double Turn(const Pose& a, const Pose& b) { return RotationAngleRad(a.inverse() * b); }

class Alignment {
 public:
  Alignment(const AlignmentProblem& problem,
            AlignmentSource& source,
            const AlignmentOptions& options,
            ForEach for_each,
            const Stop& stop)
      : problem_(problem), source_(source), options_(options), for_each_(for_each), stop_(stop) {
    result_.T_map_scan = problem.T_map_scan;
    for (const ScanPair& pair : problem.pairs) {
      given_.insert({Ordered(pair.i, pair.j), pair});
    }
    for (const auto& [i, j] : problem.excluded_pairs) excluded_.insert(Ordered(i, j));
  }

  absl::StatusOr<AlignmentResult> Run(AlignmentProgress progress) {
    for (int round = 0; round < options_.max_rounds; ++round) {
      STRATA_RETURN_IF_ERROR(progress(static_cast<double>(round) / options_.max_rounds));
      STRATA_RETURN_IF_ERROR(Round());
      const AlignmentRound& done = result_.rounds.back();
      if (done.max_shift_m <= options_.settled_m && done.max_turn_rad <= options_.settled_rad) {
        result_.termination = AlignmentTermination::kSettled;
        break;
      }
    }
    STRATA_RETURN_IF_ERROR(progress(1.0));
    return std::move(result_);
  }

 private:
  const Pose& pose(std::size_t node) const { return result_.T_map_scan[node]; }

  absl::Status Round() {
    AlignmentRound round;
    std::set<NodePair> pairs = NearbyPairs();
    for (const auto& [pair, given] : given_) pairs.insert(pair);
    for (const NodePair& pair : excluded_) pairs.erase(pair);
    STRATA_RETURN_IF_ERROR(Register(pairs, round));
    PoseGraphProblem graph = GraphOf(pairs, round);
    STRATA_RETURN_IF_ERROR(AddPlanes(graph, round));
    STRATA_ASSIGN_OR_RETURN(PoseGraphSolution solution,
                            OptimizePoseGraph(graph, options_.pose_graph, stop_));
    for (std::size_t k = 0; k < solution.T_map_scan.size(); ++k) {
      const Pose& after = solution.T_map_scan[k];
      round.max_shift_m =
          std::max(round.max_shift_m, (after.translation() - pose(k).translation()).norm());
      round.max_turn_rad = std::max(round.max_turn_rad, Turn(pose(k), after));
    }
    round.before = solution.summary.before;
    round.after = solution.summary.after;
    Keep(graph, std::move(solution));
    result_.rounds.push_back(round);
    return absl::OkStatus();
  }

  // Every scan with its nearest ones.
  std::set<NodePair> NearbyPairs() const {
    std::set<NodePair> pairs;
    if (options_.neighbours == 0) return pairs;
    // A coarse grid keeps this linear in the number of scans.
    const double cell_m = options_.neighbour_radius_m;
    std::map<std::pair<std::int64_t, std::int64_t>, std::vector<std::size_t>> grid;
    const auto cell_of = [&](const Pose& T) {
      return std::pair(static_cast<std::int64_t>(std::floor(T.translation().x() / cell_m)),
                       static_cast<std::int64_t>(std::floor(T.translation().y() / cell_m)));
    };
    for (std::size_t k = 0; k < result_.T_map_scan.size(); ++k) grid[cell_of(pose(k))].push_back(k);
    for (std::size_t k = 0; k < result_.T_map_scan.size(); ++k) {
      std::vector<std::pair<double, std::size_t>> near;
      const auto [x, y] = cell_of(pose(k));
      for (std::int64_t dx = -1; dx <= 1; ++dx) {
        for (std::int64_t dy = -1; dy <= 1; ++dy) {
          const auto cell = grid.find({x + dx, y + dy});
          if (cell == grid.end()) continue;
          for (const std::size_t other : cell->second) {
            const double distance = (pose(other).translation() - pose(k).translation()).norm();
            if (other != k && distance <= cell_m) near.push_back({distance, other});
          }
        }
      }
      const std::size_t count =
          std::min(near.size(), static_cast<std::size_t>(options_.neighbours));
      std::partial_sort(
          near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count), near.end());
      for (std::size_t n = 0; n < count; ++n) {
        pairs.insert(Ordered(k, near[n].second));
      }
    }
    return pairs;
  }

  // Registers the pairs that are not known at the current poses, grouped by the scan they are
  // matched to, whose search structure is made once.
  absl::Status Register(const std::set<NodePair>& pairs, AlignmentRound& round) {
    std::vector<std::vector<NodePair>> groups;
    for (const NodePair& pair : pairs) {
      const Measurement& known = measurements_[pair];
      const Pose T_i_j = pose(pair.first).inverse() * pose(pair.second);
      const bool same = (known.T_i_j.translation() - T_i_j.translation()).norm() <= kSamePlaceM &&
                        Turn(known.T_i_j, T_i_j) <= kSamePlaceRad;
      if (known.good && same) continue;
      if (groups.empty() || groups.back().front().first != pair.first) groups.emplace_back();
      groups.back().push_back(pair);
      ++round.registered;
    }
    return for_each_(groups.size(), [&](std::size_t g) { return RegisterGroup(groups[g]); });
  }

  absl::Status RegisterGroup(const std::vector<NodePair>& group) {
    STRATA_RETURN_IF_ERROR(stop_.status());
    const std::size_t i = group.front().first;
    STRATA_ASSIGN_OR_RETURN(const auto target_features, FeaturesOf(i));
    if (target_features == nullptr) return absl::OkStatus();
    const PlacedScan placed{target_features.get(), Pose::Identity()};
    const RegistrationTarget target({&placed, 1});
    for (const NodePair& pair : group) {
      STRATA_RETURN_IF_ERROR(stop_.status());
      STRATA_ASSIGN_OR_RETURN(const auto features, FeaturesOf(pair.second));
      if (features == nullptr) continue;
      const Pose guess = pose(i).inverse() * pose(pair.second);
      const RegistrationResult match =
          RegisterScan(*features, target, guess, options_.registration);
      Measurement& measured = measurements_.find(pair)->second;
      measured.good = Acceptable(match.termination);
      if (!measured.good) continue;
      measured.T_i_j = Normalized(match.T_target_source);
      measured.information =
          Loosened(match.information,
                   Diagonal(options_.registration_sigma_rad, options_.registration_sigma_m));
    }
    return absl::OkStatus();
  }

  // nullptr: damaged.
  absl::StatusOr<std::shared_ptr<const ScanFeatures>> FeaturesOf(std::size_t node) {
    absl::StatusOr<std::shared_ptr<const ScanFeatures>> features = source_.Features(node);
    if (absl::IsDataLoss(features.status())) return std::shared_ptr<const ScanFeatures>();
    return features;
  }

  PoseGraphProblem GraphOf(const std::set<NodePair>& pairs, AlignmentRound& round) {
    PoseGraphProblem graph;
    graph.T_map_scan = result_.T_map_scan;
    graph.fixed = problem_.fixed;
    graph.priors = problem_.priors;
    graph.relative = problem_.relative;
    pair_of_term_.assign(graph.relative.size(), std::nullopt);
    for (const NodePair& pair : pairs) {
      const Measurement& measured = measurements_[pair];
      const auto given = given_.find(pair);
      if (!measured.good && given == given_.end()) continue;
      RelativePoseTerm term;
      term.i = pair.first;
      term.j = pair.second;
      // What is merely near may be another storey, or behind a wall.
      term.may_be_false = given == given_.end() || given->second.may_be_false;
      if (measured.good) {
        term.T_i_j = measured.T_i_j;
        term.information = measured.information;
        ++round.pairs;
      } else {
        if (term.may_be_false) continue;
        term.T_i_j = problem_.T_map_scan[term.i].inverse() * problem_.T_map_scan[term.j];
        term.information = Diagonal(given->second.sigma_rad, given->second.sigma_m);
      }
      graph.relative.push_back(term);
      pair_of_term_.push_back(given == given_.end() ? std::nullopt
                                                    : std::optional<ScanPair>(given->second));
    }
    return graph;
  }

  absl::Status AddPlanes(PoseGraphProblem& graph, AlignmentRound& round) {
    shared_.clear();
    if (!options_.planes) return absl::OkStatus();
    std::vector<std::shared_ptr<const ScanPlanes>> held(graph.T_map_scan.size());
    STRATA_RETURN_IF_ERROR(for_each_(held.size(), [&](std::size_t k) -> absl::Status {
      absl::StatusOr<std::shared_ptr<const ScanPlanes>> planes = source_.Planes(k);
      if (absl::IsDataLoss(planes.status())) {
        held[k] = std::make_shared<const ScanPlanes>();
        return absl::OkStatus();
      }
      STRATA_RETURN_IF_ERROR(planes.status());
      held[k] = *std::move(planes);
      return absl::OkStatus();
    }));
    std::vector<PosedPlanes> posed;
    for (std::size_t k = 0; k < held.size(); ++k) posed.push_back({held[k].get(), pose(k)});
    shared_ = FindSharedPlanes(posed, options_.shared_planes);
    std::erase_if(shared_, [this](const SharedPlane& plane) {
      return std::any_of(
          problem_.excluded_planes.begin(),
          problem_.excluded_planes.end(),
          [&](const ExcludedPlane& excluded) { return IsExcluded(plane, excluded); });
    });
    for (const SharedPlane& plane : shared_) {
      PlaneTerm term;
      term.plane_map = plane.plane;
      for (const SharedPlane::View& view : plane.views) {
        term.views.push_back({view.scan, view.moments});
        ++round.supports;
      }
      graph.planes.push_back(std::move(term));
    }
    round.planes = shared_.size();
    return absl::OkStatus();
  }

  void Keep(const PoseGraphProblem& graph, PoseGraphSolution solution) {
    result_.T_map_scan = std::move(solution.T_map_scan);
    result_.measured.assign(
        graph.relative.begin() + static_cast<std::ptrdiff_t>(problem_.relative.size()),
        graph.relative.end());
    result_.rejected.clear();
    for (const RejectedTerm& rejected : solution.summary.rejected_relative) {
      if (pair_of_term_[rejected.term].has_value()) {
        result_.rejected.push_back(*pair_of_term_[rejected.term]);
      }
    }
    for (std::size_t p = 0; p < shared_.size(); ++p) shared_[p].plane = solution.planes[p];
    result_.planes = shared_;
    result_.worst_nodes = std::move(solution.summary.worst_nodes);
  }

  const AlignmentProblem& problem_;
  AlignmentSource& source_;
  const AlignmentOptions& options_;
  const ForEach for_each_;
  const Stop& stop_;
  std::map<NodePair, ScanPair> given_;
  std::set<NodePair> excluded_;
  std::map<NodePair, Measurement> measurements_;
  std::vector<std::optional<ScanPair>> pair_of_term_;  // beside the graph's relative terms
  std::vector<SharedPlane> shared_;
  AlignmentResult result_;
};

absl::Status CheckProblem(const AlignmentProblem& problem) {
  const std::size_t nodes = problem.T_map_scan.size();
  for (const Pose& T_map_scan : problem.T_map_scan)
    STRATA_RETURN_IF_ERROR(ValidatePose(T_map_scan));
  for (const ScanPair& pair : problem.pairs) {
    if (pair.i >= nodes || pair.j >= nodes || pair.i == pair.j) {
      return absl::InvalidArgumentError(absl::StrCat(
          "pair of scans ", pair.i, " and ", pair.j, ": not two different ones of ", nodes));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ForEachInTurn(std::size_t count, absl::FunctionRef<absl::Status(std::size_t)> body) {
  for (std::size_t k = 0; k < count; ++k) STRATA_RETURN_IF_ERROR(body(k));
  return absl::OkStatus();
}

absl::StatusOr<AlignmentResult> AlignScans(const AlignmentProblem& problem,
                                           AlignmentSource& source,
                                           const AlignmentOptions& options,
                                           ForEach for_each,
                                           AlignmentProgress progress,
                                           const Stop& stop) {
  STRATA_RETURN_IF_ERROR(CheckProblem(problem));
  return Alignment(problem, source, options, for_each, stop).Run(progress);
}

}  // namespace strata
