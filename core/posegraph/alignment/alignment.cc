#include "core/posegraph/alignment/alignment.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"

#include "core/common/status.h"
#include "core/posegraph/alignment/alignment_problem.h"
#include "core/posegraph/alignment/odometry_noise.h"
#include "core/posegraph/alignment/parts.h"
#include "core/posegraph/alignment/scan_matches.h"
#include "core/posegraph/alignment/shared_surfaces.h"
#include "core/posegraph/alignment/step_check.h"
#include "core/posegraph/information.h"
#include "core/posegraph/solver/optimize_pose_graph.h"

namespace strata {
namespace {

// Scans that a doubtful step is checked by, on both sides of it.
constexpr std::size_t kCheckedBefore = 5;
constexpr std::size_t kCheckedAfter = 3;

Pose HalfWay(const Pose& a, const Pose& b) {
  Pose half = a;
  half.translation() = 0.5 * (a.translation() + b.translation());
  half.linear() = a.linear() * So3Exp(0.5 * So3Log(a.linear().transpose() * b.linear()));
  return half;
}

double Turn(const Pose& a, const Pose& b) { return RotationAngleRad(a.inverse() * b); }

class Alignment {
 public:
  Alignment(const AlignmentProblem& problem,
            AlignmentSource& source,
            const AlignmentOptions& options,
            ForEach for_each,
            const Stop& stop)
      : ways_(problem.trajectories),
        problem_(problem),
        source_(source),
        options_(options),
        for_each_(for_each),
        stop_(stop),
        matches_(problem_, source, options),
        odometry_(problem.T_map_scan.size(), nullptr),
        lost_(problem.T_map_scan.size(), false),
        checked_(problem.T_map_scan.size(), false),
        cut_(problem.T_map_scan.size(), false),
        surfaces_(problem, source, options),
        known_by_(problem.T_map_scan.size(), Matrix6d::Zero()),
        slides_(problem.T_map_scan.size(), true) {
    result_.T_map_scan = problem.T_map_scan;
    for (const RelativePoseTerm& motion : problem_.odometry) odometry_[motion.j] = &motion;
    for (const std::size_t node : problem.lost) lost_[node] = true;
  }

  absl::StatusOr<AlignmentResult> Run(AlignmentProgress progress) {
    std::vector<Pose> before_last;
    int rounds = options_.max_rounds;
    for (int round = 0; round < rounds; ++round) {
      STRATA_RETURN_IF_ERROR(progress(static_cast<double>(round) / rounds));
      std::vector<Pose> last = result_.T_map_scan;
      const std::vector<bool> loose = matches_.loose();
      STRATA_RETURN_IF_ERROR(Round());
      bool is_at_rest = false;
      if (matches_.loose() != loose) {  // what was pooled across such a step is still in force
        before_last.clear();
      } else {
        is_at_rest = IsAtRest(last, before_last);
        before_last = std::move(last);
      }
      if (!is_at_rest && round + 1 < rounds) continue;
      STRATA_ASSIGN_OR_RETURN(const bool is_cut, CutFalseSteps());
      if (is_cut) {
        before_last.clear();
        rounds = std::max(rounds, round + 1 + options_.max_rounds);
        continue;
      }
      if (is_at_rest) result_.termination = AlignmentTermination::kSettled;
      break;
    }
    STRATA_RETURN_IF_ERROR(progress(1.0));
    return std::move(result_);
  }

 private:
  const Pose& pose(std::size_t node) const { return result_.T_map_scan[node]; }

  // Whether poses have settled. Where they swing between two states they are set half way.
  bool IsAtRest(const std::vector<Pose>& last, const std::vector<Pose>& before_last) {
    if (IsSettled(last) && !surfaces_.MayNarrow()) return true;
    if (before_last.empty() || !IsSettled(before_last)) return false;
    for (std::size_t k = 0; k < last.size(); ++k) {
      result_.T_map_scan[k] = HalfWay(last[k], result_.T_map_scan[k]);
    }
    return true;
  }

  // Whether every scan is where it was.
  bool IsSettled(const std::vector<Pose>& before) const {
    for (std::size_t k = 0; k < before.size(); ++k) {
      if (!Near(before[k], pose(k), options_.settled_m, options_.settled_rad)) return false;
    }
    return true;
  }

  // Those that are joined by a match that nobody verified, or that says something else than the
  // robot, and that were not checked yet.
  std::vector<DoubtfulStep> DoubtfulSteps() const {
    std::vector<DoubtfulStep> steps;
    for (const std::vector<std::size_t>& way : ways_) {
      const std::optional<OdometryNoise> noise = NoiseOf(way);
      for (std::size_t k = 1; k < way.size(); ++k) {
        const std::size_t node = way[k];
        if (checked_[node] || odometry_[node] == nullptr || !AreOnePart(way[k - 1], node)) continue;
        const Pose error =
            odometry_[node]->T_i_j.inverse() * pose(odometry_[node]->i).inverse() * pose(node);
        if (!lost_[node] && !IsJump(error, noise.value_or(OdometryNoise()))) continue;
        steps.push_back(StepTo(way, k));
      }
    }
    return steps;
  }

  bool AreOnePart(std::size_t a, std::size_t b) const {
    return result_.parts[a] == result_.parts[b];
  }

  DoubtfulStep StepTo(const std::vector<std::size_t>& way, std::size_t k) const {
    DoubtfulStep step;
    const auto begins_anew = [&](std::size_t i) { return lost_[way[i]] || cut_[way[i]]; };
    for (std::size_t i = k; i > 0 && step.before.size() < kCheckedBefore; --i) {
      if ((i < k && begins_anew(i)) || !AreOnePart(way[i - 1], way[k])) break;
      step.before.push_back(way[i - 1]);
    }
    for (std::size_t i = k; i < way.size() && step.after.size() < kCheckedAfter; ++i) {
      if ((i > k && begins_anew(i)) || !AreOnePart(way[i], way[k])) break;
      step.after.push_back(way[i]);
    }
    const RelativePoseTerm& said = *odometry_[way[k]];
    step.is_verified = !lost_[way[k]];
    step.T_said_found = pose(said.i) * said.T_i_j * pose(way[k]).inverse();
    return step;
  }

  // Takes out what does not hold, as if nothing had been found there. Whether there was any.
  absl::StatusOr<bool> CutFalseSteps() {
    const std::vector<DoubtfulStep> steps = DoubtfulSteps();
    std::vector<char> holds(steps.size(), 1);
    STRATA_RETURN_IF_ERROR(for_each_(steps.size(), [&](std::size_t k) -> absl::Status {
      STRATA_RETURN_IF_ERROR(stop_.status());
      STRATA_ASSIGN_OR_RETURN(
          holds[k], StepHolds(steps[k], result_.T_map_scan, source_, options_.registration));
      return absl::OkStatus();
    }));
    bool is_any = false;
    for (std::size_t k = 0; k < steps.size(); ++k) {
      const std::size_t node = steps[k].after[0];
      checked_[node] = true;
      if (holds[k] != 0) continue;
      cut_[node] = true;
      is_any = true;
    }
    if (!is_any) return false;
    CutBefore(cut_, problem_);
    matches_.ProblemChanged();
    return true;
  }

  absl::Status Round() {
    AlignmentRound round;
    STRATA_RETURN_IF_ERROR(matches_.Register(result_.T_map_scan, for_each_, stop_, round));
    PoseGraphProblem graph = Graph(round);
    STRATA_RETURN_IF_ERROR(surfaces_.Find(result_.T_map_scan, for_each_));
    surfaces_.AddTo(graph);
    STRATA_ASSIGN_OR_RETURN(PoseGraphSolution solution, Solve(graph));
    if (surfaces_.Split(PartsOfPlanes(graph, solution.summary))) {
      surfaces_.AddTo(graph);
      STRATA_ASSIGN_OR_RETURN(solution, Solve(graph));
    }
    for (const SharedPlane& plane : surfaces_.planes()) round.supports += plane.views.size();
    round.planes = surfaces_.planes().size();
    round.directions = surfaces_.directions();
    for (std::size_t k = 0; k < solution.T_map_scan.size(); ++k) {
      const Pose& after = solution.T_map_scan[k];
      round.max_shift_m =
          std::max(round.max_shift_m, (after.translation() - pose(k).translation()).norm());
      round.max_turn_rad = std::max(round.max_turn_rad, Turn(pose(k), after));
    }
    round.before = solution.summary.before;
    round.after = solution.summary.after;
    surfaces_.Moved(round.max_shift_m, round.max_turn_rad);
    Keep(graph, std::move(solution));
    result_.rounds.push_back(round);
    return absl::OkStatus();
  }

  // What is false is decided in the first round and where poses have settled; between, as long as
  // the decisions fit.
  absl::StatusOr<PoseGraphSolution> Solve(PoseGraphProblem& graph) const {
    const bool known = RecallDecisions(graph);
    STRATA_ASSIGN_OR_RETURN(PoseGraphSolution solution,
                            OptimizePoseGraph(graph, options_.pose_graph, stop_));
    if (!known || !IsSettled(solution.T_map_scan)) return solution;
    for (RelativePoseTerm& term : graph.relative) term.believed.reset();
    for (PriorTerm& term : graph.priors) term.believed.reset();
    return OptimizePoseGraph(graph, options_.pose_graph, stop_);
  }

  // Whether the round before decided on any term.
  bool RecallDecisions(PoseGraphProblem& graph) const {
    bool any = false;
    for (std::size_t k = 0; k < graph.relative.size(); ++k) {
      if (!graph.relative[k].may_be_false) continue;
      const auto known = believed_.find(DecisionOn(graph, k));
      if (known == believed_.end()) continue;
      graph.relative[k].believed = known->second;
      any = true;
    }
    for (std::size_t k = 0; k < believed_priors_.size(); ++k) {
      if (!graph.priors[k].may_be_false) continue;
      graph.priors[k].believed = believed_priors_[k];
      any = true;
    }
    return any;
  }

  // Of a term that may be false: the given ones by their place, matches by their scans.
  using Decision = std::tuple<std::size_t, std::size_t, std::size_t>;
  Decision DecisionOn(const PoseGraphProblem& graph, std::size_t k) const {
    return {graph.relative[k].i, graph.relative[k].j, std::min(k, problem_.relative.size())};
  }

  PoseGraphProblem Graph(const AlignmentRound& round) {
    PoseGraphProblem graph;
    graph.T_map_scan = result_.T_map_scan;
    graph.fixed = problem_.fixed;
    graph.priors = problem_.priors;
    graph.relative = problem_.relative;
    graph.relative.reserve(graph.relative.size() + kMaxPartners * round.matches);
    joins_nothing_.assign(graph.relative.size(), false);
    const std::size_t nodes = graph.T_map_scan.size();
    std::vector<bool> known(nodes, false);
    std::vector<Matrix6d> information(nodes, Matrix6d::Zero());
    const std::vector<bool> out_of_line = OutOfLine();
    for (std::size_t node = 0; node < nodes; ++node) {
      if (out_of_line[node]) continue;
      for (const ScanMatch& match : matches_.of(node)) {
        for (const auto& [i, T_i_scan] : match.T_i_scan) {
          graph.relative.push_back({i, node, T_i_scan, match.Share(), match.chain.may_be_false});
          joins_nothing_.push_back(match.joins_nothing);
        }
        if (!match.good || match.chain.may_be_false) continue;
        known[node] = true;
        information[node] += match.information;
      }
      for (const ScanPair* pair : matches_.MeasuredInForce(node, result_.T_map_scan)) {
        const Matrix6d loosened = LoosenedBy(options_, pair->measured->information);
        graph.relative.push_back(
            {pair->i, node, pair->measured->T_i_j, loosened, pair->may_be_false});
        const bool may_be_false = pair->may_be_false || lost_[node];
        joins_nothing_.push_back(may_be_false && Slides(odometry_[node], loosened));
        information[node] += loosened;
        known[node] = true;
      }
    }
    measured_end_ = graph.relative.size();
    for (std::size_t node = 0; node < nodes; ++node) {
      if (out_of_line[node]) graph.relative.push_back(*odometry_[node]);
    }
    for (const ScanPair& pair : problem_.pairs) {
      if (known[pair.j] || pair.may_be_false || out_of_line[pair.j]) continue;
      graph.relative.push_back(
          {pair.i,
           pair.j,
           Normalized(problem_.T_map_scan[pair.i].inverse() * problem_.T_map_scan[pair.j]),
           IsotropicInformation(pair.sigma_rad, pair.sigma_m)});
    }
    AddOdometry(known, information, graph);
    return graph;
  }

  // Of every node: it was looked for in vain when it came in, matches now far from where its robot
  // says, and the scans before and after it agree with the robot: no match of it counts.
  std::vector<bool> OutOfLine() const {
    std::vector<bool> out_of_line(result_.T_map_scan.size(), false);
    if (problem_.lost.empty()) return out_of_line;
    for (const std::vector<std::size_t>& way : ways_) {
      const std::optional<OdometryNoise> noise = NoiseOf(way);
      for (std::size_t k = 1; noise.has_value() && k + 1 < way.size(); ++k) {
        const RelativePoseTerm* const to = odometry_[way[k]];
        const RelativePoseTerm* const from = odometry_[way[k + 1]];
        const std::optional<Pose> matched = MatchedPose(way[k]);
        if (!lost_[way[k]] || !matched.has_value() || to == nullptr || from == nullptr) continue;
        const Pose T_before_map = pose(way[k - 1]).inverse();
        const Pose T_before_after = to->T_i_j * from->T_i_j;
        out_of_line[way[k]] =
            IsJump(to->T_i_j.inverse() * T_before_map * *matched, *noise) &&
            !IsJump(T_before_after.inverse() * T_before_map * pose(way[k + 1]), *noise);
      }
    }
    return out_of_line;
  }

  // Where the match to what is behind it has a scan; nullopt: none.
  std::optional<Pose> MatchedPose(std::size_t node) const {
    for (const ScanMatch& match : matches_.of(node)) {
      if (!match.good || !match.chain.own) continue;
      return pose(match.T_i_scan[0].first) * match.T_i_scan[0].second;
    }
    return std::nullopt;
  }

  // What robots say of their motion: as good as it has proved to be, or where that is not known in
  // the directions that registration leaves loose.
  void AddOdometry(const std::vector<bool>& known,
                   const std::vector<Matrix6d>& information,
                   PoseGraphProblem& graph) {
    result_.sliding.clear();
    for (const std::vector<std::size_t>& trajectory : ways_) {
      const std::optional<OdometryNoise> noise = NoiseOf(trajectory);
      for (const std::size_t node : trajectory) {
        if (odometry_[node] == nullptr || !known[node] || cut_[node]) continue;
        const bool slides = SlidesBy(node, information[node]);
        if (slides) result_.sliding.push_back(node);
        const std::optional<Pose> error = OdometryError(node);
        const bool is_jump = noise.has_value() && error.has_value() && IsJump(*error, *noise);
        // A match that joins nothing says nothing against its robot's word.
        const bool is_apart = result_.parts.empty()
                                  ? lost_[node] && slides
                                  : result_.parts[odometry_[node]->i] != result_.parts[node];
        if (is_jump && !is_apart) continue;
        RelativePoseTerm term = *odometry_[node];
        term.information = noise.has_value()
                               ? IsotropicInformation(noise->sigma_rad, noise->sigma_m)
                               : WhereLess(information[node], term.information, kLooseShare);
        if (!term.information.isZero()) graph.relative.push_back(std::move(term));
      }
    }
    std::ranges::sort(result_.sliding);
    AddWords(graph);
  }

  // Of steps that were cut, where nothing else joins what is on both sides.
  void AddWords(PoseGraphProblem& graph) const {
    std::vector<bool> not_believed(graph.relative.size(), false);
    for (std::size_t k = 0; k < measured_end_; ++k) {
      const auto known = believed_.find(DecisionOn(graph, k));
      not_believed[k] =
          graph.relative[k].may_be_false && known != believed_.end() && !known->second;
    }
    DisjointSets joined = JoinedBy(graph.relative, not_believed, measured_end_);
    for (std::size_t node = 0; node < cut_.size(); ++node) {
      if (!cut_[node] || joined.AreJoined(odometry_[node]->i, node)) continue;
      graph.relative.push_back(*odometry_[node]);
    }
  }

  // The same of all that is known of it, which changes little from round to round.
  bool SlidesBy(std::size_t node, const Matrix6d& information) {
    if (known_by_[node] != information) {
      known_by_[node] = information;
      slides_[node] = Slides(odometry_[node], information);
    }
    return slides_[node];
  }

  std::optional<OdometryNoise> NoiseOf(const std::vector<std::size_t>& trajectory) const {
    std::vector<std::optional<Pose>> errors;
    for (const std::size_t node : trajectory) {
      if (odometry_[node] == nullptr) continue;
      errors.push_back(OdometryError(node));
    }
    return EstimateOdometryNoise(errors);
  }

  // Of what is said of the motion to `node`, as registration has it.
  std::optional<Pose> OdometryError(std::size_t node) const {
    const std::optional<Pose> T_i_j = matches_.Motion(odometry_[node]->i, node, result_.T_map_scan);
    if (!T_i_j.has_value()) return std::nullopt;
    return odometry_[node]->T_i_j.inverse() * *T_i_j;
  }

  // By matches and what is given, as far as it is believed. What may slide agrees with any place:
  // that two are near by the graph, or by the word of a robot that was found wrong, is all that
  // joins them.
  DisjointSets Joined(const PoseGraphProblem& graph, const PoseGraphSummary& summary) const {
    std::vector<bool> joins_nothing = joins_nothing_;
    joins_nothing.resize(graph.relative.size(), false);
    for (const auto& [k, chi2] : summary.rejected_relative) joins_nothing[k] = true;
    return JoinedBy(graph.relative, joins_nothing, measured_end_);
  }

  // Of nodes that may have planes in common: priors place all that they place.
  std::vector<std::size_t> PartsOfPlanes(const PoseGraphProblem& graph,
                                         const PoseGraphSummary& summary) const {
    std::vector<bool> placed(graph.priors.size(), true);
    for (const auto& [k, chi2] : summary.rejected_priors) placed[k] = false;
    DisjointSets joined = Joined(graph, summary);
    std::optional<std::size_t> first;
    for (std::size_t k = 0; k < placed.size(); ++k) {
      if (!placed[k]) continue;
      if (!first.has_value()) first = graph.priors[k].i;
      joined.Join(*first, graph.priors[k].i);
    }
    return PartsOf(joined, graph.T_map_scan.size());
  }

  void Keep(const PoseGraphProblem& graph, PoseGraphSolution solution) {
    result_.T_map_scan = std::move(solution.T_map_scan);
    result_.measured.clear();
    result_.rejected.clear();
    believed_.clear();
    std::vector<bool> rejected(graph.relative.size(), false);
    const std::size_t given = problem_.relative.size();
    for (const auto& [k, chi2] : solution.summary.rejected_relative) {
      rejected[k] = true;
      result_.rejected.push_back({graph.relative[k], chi2, k < given});
    }
    for (std::size_t k = 0; k < graph.relative.size(); ++k) {
      if (graph.relative[k].may_be_false) believed_[DecisionOn(graph, k)] = !rejected[k];
    }
    result_.priors = graph.priors.size();
    result_.rejected_priors = solution.summary.rejected_priors.size();
    believed_priors_.assign(graph.priors.size(), true);
    for (const auto& [k, chi2] : solution.summary.rejected_priors) believed_priors_[k] = false;
    for (std::size_t k = given; k < graph.relative.size(); ++k) {
      if (!rejected[k]) result_.measured.push_back(graph.relative[k]);
    }
    DisjointSets joined = Joined(graph, solution.summary);
    result_.parts = PartsOf(joined, graph.T_map_scan.size());
    surfaces_.Keep(solution.planes);
    result_.planes = surfaces_.planes();
    result_.worst_nodes = std::move(solution.summary.worst_nodes);
  }

  const std::vector<std::vector<std::size_t>>& ways_;  // of robots, whole
  AlignmentProblem problem_;                           // without what was taken out
  AlignmentSource& source_;
  const AlignmentOptions& options_;
  const ForEach for_each_;
  const Stop& stop_;
  ScanMatches matches_;
  std::vector<const RelativePoseTerm*> odometry_;  // of every node j; nullptr: none
  std::vector<bool> lost_;                         // of every node
  std::vector<bool> checked_;                      // of every node: the step to it
  std::vector<bool> cut_;                          // of every node: the step to it does not hold
  SharedSurfaces surfaces_;
  std::map<Decision, bool> believed_;  // in the round before
  std::vector<bool> believed_priors_;
  std::vector<bool> joins_nothing_;  // of the graph's relative terms, up to measured_end_
  std::vector<Matrix6d> known_by_;   // of every node: what slides_ was asked of
  std::vector<bool> slides_;
  std::size_t measured_end_ = 0;  // of the graph's relative terms: what is given or a match
  AlignmentResult result_;
};

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
  const Eigen::Vector3d middle = FarMiddle(problem);
  if (middle.isZero(0.0)) return Alignment(problem, source, options, for_each, stop).Run(progress);
  AlignmentProblem near = problem;
  MoveZero(middle, near);
  STRATA_ASSIGN_OR_RETURN(AlignmentResult result,
                          Alignment(near, source, options, for_each, stop).Run(progress));
  MoveZero(-middle, result);
  return result;
}

}  // namespace strata
