#include "core/posegraph/closures/closure_candidates.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"

#include "core/common/option_checks.h"
#include "core/common/status.h"
#include "core/registration/upright_frame.h"

namespace strata {
namespace {

constexpr double kMaxSources = 1000.0;
constexpr double kInfinite = std::numeric_limits<double>::infinity();
// Telling of a closure: the logarithm of how much surer it makes the relative pose than this.
constexpr double kClosureSigmaM = 0.1;
constexpr double kMostTellingM = 100.0;
// Windows are never narrower: cells, and the image the search begins with.
constexpr double kLeastRadiusM = 3.0;
constexpr double kLeastHeightM = 1.5;
constexpr double kMostHeightM = 10.0;
constexpr double kLeastHeading = 0.1;

// A piece of one trajectory.
using Segment = std::pair<std::uint32_t, std::int64_t>;

struct Layout {
  std::vector<Segment> segments;       // of each node
  std::vector<std::size_t> sources;    // nodes from which the graph is searched
  std::vector<std::size_t> source_of;  // of each node: index into sources, the last before it
};

Layout LayOut(std::span<const ClosureNode> nodes, double segment_m) {
  std::map<std::uint32_t, std::pair<std::size_t, double>> last;  // node and way
  std::vector<double> way(nodes.size(), 0.0);
  double all = 0.0;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto [at, is_new] = last.try_emplace(nodes[i].trajectory, i, 0.0);
    if (!is_new) {
      const double step =
          (nodes[i].T_map_scan.translation() - nodes[at->second.first].T_map_scan.translation())
              .norm();
      way[i] = at->second.second + step;
      all += step;
      at->second = {i, way[i]};
    }
  }
  const double spacing = std::max(0.5 * segment_m, all / kMaxSources);
  Layout layout;
  std::map<std::uint32_t, std::size_t> last_source;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    layout.segments.emplace_back(nodes[i].trajectory,
                                 static_cast<std::int64_t>(std::floor(way[i] / segment_m)));
    const auto [at, is_new] = last_source.try_emplace(nodes[i].trajectory, layout.sources.size());
    if (is_new || way[i] - way[layout.sources[at->second]] >= spacing) {
      at->second = layout.sources.size();
      layout.sources.push_back(i);
    }
    layout.source_of.push_back(at->second);
  }
  return layout;
}

double Telling(double sigma_m) {
  return std::log1p(std::min(sigma_m, kMostTellingM) / kClosureSigmaM);
}

class CandidateSearch {
 public:
  CandidateSearch(std::span<const ClosureNode> nodes,
                  std::span<const GraphEdge> edges,
                  std::span<const AlikePair> alike,
                  const ClosureCandidateOptions& options)
      : nodes_(nodes),
        options_(options),
        layout_(LayOut(nodes, options.segment_m)),
        graph_(Poses(nodes), edges, options.drift),
        alike_of_(layout_.sources.size()) {
    for (const AlikePair& pair : alike) {
      if (pair.similarity.distance <= options.max_alike_distance) {
        alike_of_[layout_.source_of[pair.i]].push_back(pair);
      }
    }
  }

  std::vector<ClosureCandidate> Run() {
    for (std::size_t s = 0; s < layout_.sources.size(); ++s) {
      const std::vector<PathUncertainty> known = graph_.From(layout_.sources[s]);
      AddNear(layout_.sources[s], known);
      for (const AlikePair& pair : alike_of_[s]) AddAlike(pair, known[pair.j]);
    }
    return Spread();
  }

 private:
  static std::vector<Pose> Poses(std::span<const ClosureNode> nodes) {
    std::vector<Pose> poses;
    for (const ClosureNode& node : nodes) poses.push_back(node.T_map_scan);
    return poses;
  }

  double Apart(std::size_t i, std::size_t j) const {
    return (nodes_[i].T_map_scan.translation() - nodes_[j].T_map_scan.translation()).norm();
  }
  bool SaysNothingNew(const PathUncertainty& known) const {
    return known.connected && (known.hops < options_.min_hops || known.way_m < options_.min_way_m);
  }
  bool MayBeNear(double apart_m, const PathUncertainty& known) const {
    return apart_m <= options_.view_range_m + options_.sigmas * known.sigma_m;
  }

  // The likeliest pair of `i` with each segment.
  void AddNear(std::size_t i, const std::vector<PathUncertainty>& known) {
    std::map<Segment, ClosureCandidate> best;
    for (std::size_t j = 0; j < nodes_.size(); ++j) {
      // Frames that nothing joins are often one all the same: then the poses are as they should be.
      const PathUncertainty& u = known[j];
      if (j == i || SaysNothingNew(u)) continue;
      if (options_.sigmas * u.sigma_m > options_.max_window_m) continue;
      const double apart = Apart(i, j);
      if (!MayBeNear(apart, u)) continue;
      const double range = options_.view_range_m;
      const double spread = range * range + u.sigma_m * u.sigma_m;
      const double likely = range * range / spread * std::exp(-0.5 * apart * apart / spread);
      ClosureCandidate& held = best[layout_.segments[j]];
      const double score = likely * Telling(u.connected ? u.sigma_m : kInfinite);
      if (score > held.score) held = Candidate(i, j, u, ClosureReason::kNear, score);
    }
    for (auto& [segment, candidate] : best) {
      candidate.hypotheses = {GraphHypothesis(candidate)};
      candidates_.push_back(std::move(candidate));
    }
  }

  // `known` of j relative to the source of i.
  void AddAlike(const AlikePair& pair, const PathUncertainty& known) {
    if (SaysNothingNew(known)) return;
    if (known.connected && !MayBeNear(Apart(pair.i, pair.j), known)) return;
    const double sigma_m = known.connected ? known.sigma_m : kInfinite;
    const double score = std::max(0.0, 1.0 - pair.similarity.distance) * Telling(sigma_m);
    ClosureCandidate candidate = Candidate(pair.i, pair.j, known, ClosureReason::kAlike, score);
    if (known.connected && options_.sigmas * sigma_m <= options_.max_window_m) {
      candidate.hypotheses = {GraphHypothesis(candidate)};
    } else {
      candidate.hypotheses = LooksHypotheses(pair, candidate);
      // What looks alike must fit better elsewhere than as it is.
      if (!known.connected) candidate.hypotheses.push_back(GraphHypothesis(candidate));
      if (candidate.hypotheses.empty()) return;
    }
    candidates_.push_back(std::move(candidate));
  }

  ClosureCandidate Candidate(std::size_t i,
                             std::size_t j,
                             const PathUncertainty& known,
                             ClosureReason reason,
                             double score) const {
    ClosureCandidate c;
    std::tie(c.i, c.j) = std::minmax(i, j);
    c.T_i_j = Normalized(nodes_[c.i].T_map_scan.inverse() * nodes_[c.j].T_map_scan);
    c.sigma_m = known.connected ? known.sigma_m : kInfinite;
    c.sigma_rad = known.connected ? known.sigma_rad : kInfinite;
    c.reason = reason;
    c.score = score;
    return c;
  }

  // Those of the two headings that the graph allows.
  std::vector<PlaceHypothesis> LooksHypotheses(const AlikePair& pair,
                                               const ClosureCandidate& c) const {
    PlaceSimilarity similarity = pair.similarity;
    if (pair.i > pair.j) similarity.heading_rad *= -1.0;  // of j in i
    const Eigen::Matrix3d R_upright_i = UprightTurn(UpOf(nodes_[c.i].T_map_scan));
    const Eigen::Matrix3d R_upright_j = UprightTurn(UpOf(nodes_[c.j].T_map_scan));
    // Of the upright j in the upright i.
    const auto heading = [&](const Pose& T_i_j) {
      const Eigen::Matrix3d R = R_upright_i * T_i_j.linear() * R_upright_j.transpose();
      return std::atan2(R(1, 0), R(0, 0));
    };
    std::vector<PlaceHypothesis> hypotheses = HypothesesOf(similarity, R_upright_i, R_upright_j);
    std::erase_if(hypotheses, [&](const PlaceHypothesis& h) {
      const double turned = heading(h.T_target_source) - heading(c.T_i_j);
      return std::abs(std::remainder(turned, 2.0 * std::numbers::pi)) >
             options_.sigmas * c.sigma_rad + h.heading_range_rad;
    });
    return hypotheses;
  }

  // As far around the current poses as the graph leaves open.
  PlaceHypothesis GraphHypothesis(const ClosureCandidate& c) const {
    if (std::isinf(c.sigma_m)) return SaidHypothesis(c.T_i_j);
    const double reach = options_.sigmas * c.sigma_m;
    return {c.T_i_j,
            std::clamp(reach, kLeastRadiusM, options_.max_window_m),
            std::clamp(reach, kLeastHeightM, kMostHeightM),
            std::clamp(options_.sigmas * c.sigma_rad, kLeastHeading, std::numbers::pi)};
  }

  // Best first, a few of every two segments.
  std::vector<ClosureCandidate> Spread() {
    std::stable_sort(candidates_.begin(), candidates_.end(), [](const auto& a, const auto& b) {
      return std::tuple(-a.score, a.i, a.j) < std::tuple(-b.score, b.i, b.j);
    });
    std::map<std::tuple<Segment, Segment, ClosureReason>, int> taken;
    std::map<std::pair<std::size_t, std::size_t>, bool> pairs;
    std::vector<ClosureCandidate> spread;
    for (ClosureCandidate& c : candidates_) {
      if (static_cast<int>(spread.size()) >= options_.max_candidates) break;
      if (pairs.contains({c.i, c.j})) continue;
      const auto [a, b] = std::minmax(layout_.segments[c.i], layout_.segments[c.j]);
      if (++taken[{a, b, c.reason}] > options_.per_segment) continue;
      pairs[{c.i, c.j}] = true;
      spread.push_back(std::move(c));
    }
    return spread;
  }

  std::span<const ClosureNode> nodes_;
  const ClosureCandidateOptions& options_;
  Layout layout_;
  PathUncertainties graph_;
  std::vector<std::vector<AlikePair>> alike_of_;  // of each source
  std::vector<ClosureCandidate> candidates_;
};

absl::Status CheckInput(std::span<const ClosureNode> nodes,
                        std::span<const GraphEdge> edges,
                        std::span<const AlikePair> alike) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    STRATA_RETURN_IF_ERROR(
        Annotate(ValidatePose(nodes[i].T_map_scan), absl::StrCat("closure node ", i)));
  }
  const auto check = [&](absl::string_view what, std::size_t at, std::size_t i, std::size_t j) {
    if (i < nodes.size() && j < nodes.size() && i != j) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat(what,
                                                   " ",
                                                   at,
                                                   " joins ",
                                                   i,
                                                   " and ",
                                                   j,
                                                   ", must be two different nodes of ",
                                                   nodes.size()));
  };
  for (std::size_t e = 0; e < edges.size(); ++e) {
    STRATA_RETURN_IF_ERROR(check("graph edge", e, edges[e].i, edges[e].j));
  }
  for (std::size_t p = 0; p < alike.size(); ++p) {
    STRATA_RETURN_IF_ERROR(check("alike pair", p, alike[p].i, alike[p].j));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status ClosureCandidateOptions::Validate() const {
  OptionChecks checks("closure candidate options");
  checks.InRange("view_range_m", view_range_m, 0.5, 200.0);
  checks.InRange("sigmas", sigmas, 0.0, 10.0);
  checks.InRange("min_hops", min_hops, 0, 1000000);
  checks.InRange("min_way_m", min_way_m, 0.0, 1e6);
  checks.InRange("max_alike_distance", max_alike_distance, 0.0, 2.0);
  checks.InRange("segment_m", segment_m, 0.1, 1e4);
  checks.InRange("per_segment", per_segment, 1, 1000);
  checks.InRange("max_window_m", max_window_m, 1.0, 200.0);
  checks.InRange("max_candidates", max_candidates, 1, 1000000);
  STRATA_RETURN_IF_ERROR(checks.status());
  return drift.Validate();
}

absl::StatusOr<std::vector<ClosureCandidate>> FindClosureCandidates(
    std::span<const ClosureNode> nodes,
    std::span<const GraphEdge> edges,
    std::span<const AlikePair> alike,
    const ClosureCandidateOptions& options) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  STRATA_RETURN_IF_ERROR(CheckInput(nodes, edges, alike));
  return CandidateSearch(nodes, edges, alike, options).Run();
}

}  // namespace strata
