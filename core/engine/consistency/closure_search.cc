#include "core/engine/consistency/closure_search.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <set>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"

#include "core/common/status.h"
#include "core/engine/consistency/contradicted_joins.h"
#include "core/engine/map/parallel.h"
#include "core/engine/scans/matching.h"
#include "core/posegraph/closures/closure_candidates.h"
#include "core/posegraph/closures/closure_consistency.h"
#include "core/posegraph/information.h"
#include "core/posegraph/solver/optimize_pose_graph.h"
#include "core/registration/place_index.h"
#include "core/registration/place_match.h"

namespace strata {
namespace {

// Looked up for every scan.
constexpr std::size_t kAlikeScans = 4;
// Closing loops moves poses, which makes other pairs likely.
constexpr int kMaxPasses = 3;
// Between parts that are still apart every place in common counts: where one robot drives over
// another, those nearest to each other show nothing in common, and some a few metres on do.
constexpr double kFineSegmentM = 2.5;
constexpr int kMaxFinePasses = 4;
constexpr std::size_t kFineCandidates = 24;  // of a pass
// Errors of a match beside what its information says.
constexpr double kMatchSigmaM = 0.05;
constexpr double kMatchSigmaRad = 0.005;

class Searcher {
 public:
  Searcher(const GraphWorld& world,
           ScanViews& views,
           std::size_t first_new,
           const OptimizeSettings& settings,
           int threads,
           JobContext& context)
      : world_(world),
        views_(views),
        first_new_(first_new),
        settings_(settings),
        threads_(threads),
        context_(context),
        measured_(world.Measured(settings)) {
    search_.T_map_scan = world.Poses();
  }

  absl::StatusOr<ClosureSearch> Run() {
    STRATA_RETURN_IF_ERROR(FindAlike());
    for (int pass = 0; pass < kMaxPasses; ++pass, ++pass_) {
      STRATA_ASSIGN_OR_RETURN(const bool is_any, Close());
      if (!is_any) break;
    }
    is_fine_ = true;
    for (int pass = 0; pass < kMaxFinePasses; ++pass, ++pass_) {
      STRATA_RETURN_IF_ERROR(Close().status());
    }
    STRATA_RETURN_IF_ERROR(TakeBackContradicted());
    search_.matched = matched_.size();
    return std::move(search_);
  }

 private:
  // Whether any candidate matched.
  absl::StatusOr<bool> Close() {
    STRATA_ASSIGN_OR_RETURN(const std::vector<ClosureCandidate> candidates, Candidates());
    const std::size_t before = matched_.size();
    STRATA_RETURN_IF_ERROR(Verify(candidates));
    if (matched_.size() == before) return false;
    STRATA_RETURN_IF_ERROR(KeepConsistent());
    STRATA_RETURN_IF_ERROR(CloseLoops());
    return true;
  }

  absl::Status FindAlike() {
    std::vector<PlaceDescriptor> places(world_.size());
    STRATA_RETURN_IF_ERROR(
        ParallelFor(threads_, places.size(), [&](int thread, std::size_t k) -> absl::Status {
          if (thread == 0) {
            const double share = static_cast<double>(k) / static_cast<double>(places.size());
            STRATA_RETURN_IF_ERROR(context_.Progress(0.4 * share, "describing places"));
          }
          absl::StatusOr<PlaceDescriptor> place = views_.Place(k);
          if (absl::IsDataLoss(place.status())) return absl::OkStatus();
          STRATA_RETURN_IF_ERROR(place.status());
          places[k] = *std::move(place);
          return absl::OkStatus();
        }));
    return LookUp(places);
  }

  absl::Status LookUp(const std::vector<PlaceDescriptor>& places) {
    PlaceIndex index;
    for (std::size_t k = 0; k < places.size(); ++k) index.Add(k, places[k]);
    std::vector<std::vector<PlaceIndex::Neighbour>> nearest(places.size());
    STRATA_RETURN_IF_ERROR(ParallelFor(threads_, places.size(), [&](int, std::size_t k) {
      if (k < first_new_) return absl::OkStatus();
      // Each pair once; scans just before are alike and tell nothing.
      const auto excluded = [&](std::uint64_t other) {
        return other >= k || world_.SamePass(static_cast<std::size_t>(other), k);
      };
      nearest[k] = index.Nearest(places[k], kAlikeScans, excluded);
      return context_.stop().status();
    }));
    for (std::size_t k = 0; k < places.size(); ++k) {
      for (const PlaceIndex::Neighbour& near : nearest[k]) {
        alike_.push_back({static_cast<std::size_t>(near.number), k, near.similarity});
      }
    }
    return absl::OkStatus();
  }

  absl::StatusOr<std::vector<ClosureCandidate>> Candidates() {
    std::vector<ClosureNode> nodes;
    for (std::size_t k = 0; k < world_.size(); ++k) {
      nodes.push_back(
          {search_.T_map_scan[k], static_cast<std::uint32_t>(world_.PlaceOf(k).trajectory)});
    }
    std::vector<GraphEdge> edges = measured_.edges;
    for (const FoundClosure& closure : search_.closures) {
      edges.push_back({closure.i, closure.j, closure.information});
    }
    ClosureCandidateOptions options;
    if (is_fine_) options.segment_m = kFineSegmentM;
    STRATA_ASSIGN_OR_RETURN(std::vector<ClosureCandidate> candidates,
                            FindClosureCandidates(nodes, edges, alike_, options));
    std::erase_if(candidates, [this](const ClosureCandidate& candidate) {
      return std::max(candidate.i, candidate.j) < first_new_ ||
             (is_fine_ && std::isfinite(candidate.sigma_m)) ||
             tried_.contains({candidate.i, candidate.j});
    });
    if (is_fine_) candidates = Spread(std::move(candidates));
    for (const ClosureCandidate& candidate : candidates) tried_.insert({candidate.i, candidate.j});
    return candidates;
  }

  // A few, from best to worst: what is nearest need not show most in common.
  static std::vector<ClosureCandidate> Spread(std::vector<ClosureCandidate> candidates) {
    std::vector<ClosureCandidate> few;
    const std::size_t step = (candidates.size() + kFineCandidates - 1) / kFineCandidates;
    for (std::size_t k = 0; k < candidates.size(); k += step) {
      few.push_back(std::move(candidates[k]));
    }
    return few;
  }

  // The scans around `node` on its trajectory, in its frame: a pooled local map.
  absl::StatusOr<std::vector<SeenScan>> PoolAround(
      std::size_t node, std::vector<std::shared_ptr<const ScanFeatures>>& held) {
    const auto& [t, place] = world_.PlaceOf(node);
    const std::vector<std::size_t>& trajectory = world_.Trajectories()[t];
    const std::size_t half = static_cast<std::size_t>(settings_.pool) / 2;
    const std::size_t first = place - std::min(place, half);
    const std::size_t last = std::min(place + half, trajectory.size() - 1);
    std::vector<SeenScan> pool;
    for (std::size_t k = first; k <= last; ++k) {
      const std::size_t member = trajectory[k];
      absl::StatusOr<std::shared_ptr<const ScanFeatures>> features = views_.Features(member);
      if (absl::IsDataLoss(features.status())) continue;
      STRATA_RETURN_IF_ERROR(features.status());
      held.push_back(*std::move(features));
      pool.push_back({held.back().get(),
                      world_.Poses()[node].inverse() * world_.Poses()[member],
                      SensorOrigin(member)});
    }
    return pool;
  }

  Eigen::Vector3d SensorOrigin(std::size_t node) const {
    return views_.scan(node).header.sensor_origin.cast<double>();
  }

  absl::StatusOr<std::optional<FoundClosure>> Try(const ClosureCandidate& candidate) {
    std::vector<std::shared_ptr<const ScanFeatures>> held;
    STRATA_ASSIGN_OR_RETURN(const std::vector<SeenScan> target, PoolAround(candidate.i, held));
    absl::StatusOr<std::shared_ptr<const ScanFeatures>> source = views_.Features(candidate.j);
    if (absl::IsDataLoss(source.status()) || target.empty()) return std::optional<FoundClosure>();
    STRATA_RETURN_IF_ERROR(source.status());
    const PlaceMatch match =
        MatchPlace({source->get(), Pose::Identity(), SensorOrigin(candidate.j)},
                   target,
                   candidate.hypotheses,
                   Options());
    if (!match.matched()) return std::optional<FoundClosure>();
    FoundClosure found;
    found.i = candidate.i;
    found.j = candidate.j;
    found.T_i_j = Normalized(match.T_target_source);
    found.information =
        LoosenedInformation(match.information, IsotropicInformation(kMatchSigmaRad, kMatchSigmaM));
    found.confidence = match.confidence;
    found.note =
        absl::StrFormat("%s, overlap %.2f, confidence %.2f",
                        candidate.reason == ClosureReason::kNear ? "near by the graph" : "alike",
                        match.overlap,
                        match.confidence);
    return std::optional<FoundClosure>(std::move(found));
  }

  static PlaceMatchOptions Options() {
    PlaceMatchOptions options;
    options.registration = EngineRegistrationOptions();
    return options;
  }

  absl::Status Verify(const std::vector<ClosureCandidate>& candidates) {
    std::vector<std::optional<FoundClosure>> found(candidates.size());
    STRATA_RETURN_IF_ERROR(
        ParallelFor(threads_, found.size(), [&](int thread, std::size_t k) -> absl::Status {
          STRATA_RETURN_IF_ERROR(context_.stop().status());
          if (thread == 0) {
            const double share = static_cast<double>(k) / static_cast<double>(found.size());
            STRATA_RETURN_IF_ERROR(
                context_.Progress(0.4 + 0.08 * (pass_ + share), "looking for loops to close"));
          }
          STRATA_ASSIGN_OR_RETURN(found[k], Try(candidates[k]));
          return absl::OkStatus();
        }));
    search_.tried += candidates.size();
    for (std::optional<FoundClosure>& closure : found) {
      if (closure.has_value()) matched_.push_back(*std::move(closure));
    }
    return absl::OkStatus();
  }

  // Keeps of everything that matched what agrees with the graph and with each other.
  absl::Status KeepConsistent() {
    std::vector<Closure> closures;
    for (const FoundClosure& found : matched_) {
      closures.push_back({found.i, found.j, found.T_i_j, kMatchSigmaM, kMatchSigmaRad});
    }
    STRATA_ASSIGN_OR_RETURN(const ConsistentClosureSet consistent,
                            ConsistentClosures(world_.Poses(), measured_.edges, closures));
    search_.closures.clear();
    for (const std::size_t k : consistent.kept) search_.closures.push_back(matched_[k]);
    return absl::OkStatus();
  }

  absl::Status TakeBackContradicted() {
    STRATA_ASSIGN_OR_RETURN(
        const std::vector<std::size_t> contradicted,
        ContradictedJoins(world_, views_, measured_.edges, search_.closures, search_.T_map_scan));
    if (contradicted.empty()) return absl::OkStatus();
    std::vector<FoundClosure> left;
    for (std::size_t k = 0; k < search_.closures.size(); ++k) {
      if (std::ranges::binary_search(contradicted, k)) continue;
      left.push_back(std::move(search_.closures[k]));
    }
    search_.closures = std::move(left);
    return CloseLoops();
  }

  absl::Status CloseLoops() {
    PoseGraphProblem graph = measured_.graph;
    for (const FoundClosure& closure : search_.closures) {
      graph.relative.push_back(
          {closure.i, closure.j, closure.T_i_j, closure.information, settings_.robust});
    }
    STRATA_ASSIGN_OR_RETURN(PoseGraphSolution solution,
                            OptimizePoseGraph(graph, {}, context_.stop()));
    search_.T_map_scan = std::move(solution.T_map_scan);
    std::erase_if(search_.closures, [this](const FoundClosure& found) {
      return !ClosureHolds(found.T_i_j, search_.T_map_scan[found.i], search_.T_map_scan[found.j]);
    });
    return absl::OkStatus();
  }

  const GraphWorld& world_;
  ScanViews& views_;
  const std::size_t first_new_;
  const OptimizeSettings& settings_;
  const int threads_;
  JobContext& context_;
  const MeasuredGraph measured_;
  std::vector<AlikePair> alike_;
  std::set<std::pair<std::size_t, std::size_t>> tried_;
  std::vector<FoundClosure> matched_;
  int pass_ = 0;
  bool is_fine_ = false;  // only between parts that nothing joins, and closely
  ClosureSearch search_;
};

}  // namespace

absl::StatusOr<ClosureSearch> SearchClosures(const GraphWorld& world,
                                             ScanViews& views,
                                             std::size_t first_new,
                                             const OptimizeSettings& settings,
                                             int threads,
                                             JobContext& context) {
  if (world.size() == 0) return ClosureSearch();
  return Searcher(world, views, first_new, settings, threads, context).Run();
}

}  // namespace strata
