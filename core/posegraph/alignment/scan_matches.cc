#include "core/posegraph/alignment/scan_matches.h"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "core/posegraph/information.h"
#include "core/registration/mls_registration.h"
#include "core/registration/registration_target.h"

namespace strata {
namespace {

// Within these of what was measured a match has the same correspondences.
constexpr double kSamePlaceM = 0.02;
constexpr double kSamePlaceRad = 0.002;
// Within these of what was measured when a scan came in, it still holds.
constexpr double kMeasuredPlaceM = 0.1;
constexpr double kMeasuredPlaceRad = 0.02;
// What may be false must look the same at least to this share.
constexpr double kMinDoubtfulOverlap = 0.5;

bool Acceptable(Termination termination) {
  return termination == Termination::kConverged || termination == Termination::kMaxIterations ||
         termination == Termination::kDegenerate;
}

// The poses are still about what was measured.
bool StillHolds(std::size_t node, const ScanMatch& match, std::span<const Pose> T_map_scan) {
  return match.good && std::ranges::all_of(match.T_i_scan, [&](const auto& measured) {
           const auto& [i, T_i_scan] = measured;
           return Near(
               T_map_scan[i].inverse() * T_map_scan[node], T_i_scan, kSamePlaceM, kSamePlaceRad);
         });
}

std::vector<std::size_t> Nearest(std::vector<std::size_t> nodes,
                                 const Pose& T_map_node,
                                 std::span<const Pose> T_map_scan,
                                 std::size_t count) {
  const auto distance = [&](std::size_t i) {
    return (T_map_scan[i].translation() - T_map_node.translation()).squaredNorm();
  };
  std::ranges::stable_sort(nodes, {}, distance);
  nodes.resize(std::min(nodes.size(), count));
  return nodes;
}

}  // namespace

bool Slides(const RelativePoseTerm* odometry, const Matrix6d& information) {
  return odometry != nullptr &&
         !WhereLess(information, odometry->information, kLooseShare).isZero();
}

Matrix6d LoosenedBy(const AlignmentOptions& options, const Matrix6d& information) {
  return LoosenedInformation(
      information,
      IsotropicInformation(options.registration_sigma_rad, options.registration_sigma_m));
}

bool Near(const Pose& a, const Pose& b, double distance_m, double turn_rad) {
  const Pose difference = a.inverse() * b;
  return difference.translation().norm() <= distance_m && RotationAngleRad(difference) <= turn_rad;
}

ScanMatches::ScanMatches(const AlignmentProblem& problem,
                         AlignmentSource& source,
                         const AlignmentOptions& options)
    : problem_(problem),
      source_(source),
      options_(options),
      chains_(problem, options.neighbours),
      matches_(problem.T_map_scan.size()),
      odometry_(problem.T_map_scan.size(), nullptr),
      lost_(problem.T_map_scan.size(), false),
      loose_(problem.T_map_scan.size(), false) {
  for (const RelativePoseTerm& motion : problem.odometry) odometry_[motion.j] = &motion;
  for (const std::size_t node : problem.lost) lost_[node] = true;
  ProblemChanged();
}

void ScanMatches::ProblemChanged() {
  chains_ = ScanChains(problem_, options_.neighbours);
  measured_.assign(matches_.size(), {});
  for (const ScanPair& pair : problem_.pairs) {
    if (pair.measured.has_value()) measured_[pair.j].push_back(&pair);
  }
}

absl::Status ScanMatches::Register(std::span<const Pose> T_map_scan,
                                   ForEach for_each,
                                   const Stop& stop,
                                   AlignmentRound& round) {
  std::vector<std::size_t> registered(matches_.size(), 0);
  STRATA_RETURN_IF_ERROR(for_each(matches_.size(), [&](std::size_t node) -> absl::Status {
    STRATA_RETURN_IF_ERROR(stop.status());
    STRATA_ASSIGN_OR_RETURN(registered[node], RegisterNode(node, T_map_scan));
    return absl::OkStatus();
  }));
  for (std::size_t node = 0; node < matches_.size(); ++node) {
    round.registered += registered[node];
    for (const ScanMatch& match : matches_[node]) round.matches += match.good ? 1 : 0;
  }
  FindLoose(T_map_scan);
  return absl::OkStatus();
}

// How many chains it was registered to anew.
absl::StatusOr<std::size_t> ScanMatches::RegisterNode(std::size_t node,
                                                      std::span<const Pose> T_map_scan) {
  std::size_t registered = 0;
  std::vector<ScanMatch> before = std::exchange(matches_[node], {});
  for (ScanChain& chain : chains_.Around(node, T_map_scan, loose_)) {
    if (chain.own && !MeasuredInForce(node, T_map_scan).empty()) continue;
    const auto known = std::ranges::find_if(before, [&](const ScanMatch& match) {
      return match.chain.nodes == chain.nodes && StillHolds(node, match, T_map_scan);
    });
    if (known != before.end()) {
      matches_[node].push_back(*std::move(known));
      continue;
    }
    STRATA_ASSIGN_OR_RETURN(ScanMatch match, RegisterTo(node, std::move(chain), T_map_scan));
    matches_[node].push_back(std::move(match));
    ++registered;
  }
  return registered;
}

absl::StatusOr<ScanMatch> ScanMatches::RegisterTo(std::size_t node,
                                                  ScanChain chain,
                                                  std::span<const Pose> T_map_scan) {
  ScanMatch match;
  match.chain = std::move(chain);
  STRATA_ASSIGN_OR_RETURN(const auto own, FeaturesOf(node));
  if (own == nullptr) return match;
  std::vector<std::shared_ptr<const ScanFeatures>> held;
  std::vector<PlacedScan> placed;
  std::vector<std::size_t> seen;  // nothing is measured about damaged ones
  for (const std::size_t i : match.chain.nodes) {
    STRATA_ASSIGN_OR_RETURN(auto features, FeaturesOf(i));
    if (features == nullptr) continue;
    seen.push_back(i);
    held.push_back(std::move(features));
    placed.push_back({held.back().get(), T_map_scan[i]});
  }
  const RegistrationTarget target(placed, {.centre = T_map_scan[node].translation()});
  const RegistrationResult result =
      RegisterScan(*own, target, T_map_scan[node], options_.registration);
  match.tried = !seen.empty();
  match.good = Acceptable(result.termination) &&
               (!match.chain.may_be_false || result.overlap >= kMinDoubtfulOverlap);
  if (!match.good) return match;
  match.information = LoosenedBy(options_, result.information);
  // A match that may be false is one relative pose, so that it is believed or not as a whole.
  const std::size_t partners = match.chain.may_be_false ? 1 : kMaxPartners;
  for (const std::size_t i : Nearest(seen, result.T_target_source, T_map_scan, partners)) {
    match.T_i_scan.push_back({i, Normalized(T_map_scan[i].inverse() * result.T_target_source)});
  }
  match.joins_nothing =
      (match.chain.may_be_false || lost_[node]) && Slides(odometry_[node], match.Share());
  return match;
}

// nullptr: damaged.
absl::StatusOr<std::shared_ptr<const ScanFeatures>> ScanMatches::FeaturesOf(std::size_t node) {
  absl::StatusOr<std::shared_ptr<const ScanFeatures>> features = source_.Features(node);
  if (absl::IsDataLoss(features.status())) return std::shared_ptr<const ScanFeatures>();
  return features;
}

void ScanMatches::FindLoose(std::span<const Pose> T_map_scan) {
  for (std::size_t node = 0; node < matches_.size(); ++node) {
    const auto has = [&](bool ScanMatch::*what) {
      return std::ranges::any_of(
          matches_[node], [&](const ScanMatch& match) { return match.chain.own && match.*what; });
    };
    loose_[node] = has(&ScanMatch::tried) && !has(&ScanMatch::good) &&
                   MeasuredInForce(node, T_map_scan).empty();
  }
  for (const RelativePoseTerm& term : problem_.relative) {
    if (!term.may_be_false) loose_[std::max(term.i, term.j)] = false;
  }
}

std::span<const ScanPair* const> ScanMatches::MeasuredInForce(
    std::size_t node, std::span<const Pose> T_map_scan) const {
  const bool holds = std::ranges::all_of(measured_[node], [&](const ScanPair* pair) {
    return Near(T_map_scan[pair->i].inverse() * T_map_scan[node],
                pair->measured->T_i_j,
                kMeasuredPlaceM,
                kMeasuredPlaceRad);
  });
  if (!holds) return {};
  return measured_[node];
}

std::optional<Pose> ScanMatches::Motion(std::size_t i,
                                        std::size_t j,
                                        std::span<const Pose> T_map_scan) const {
  for (const ScanPair* pair : MeasuredInForce(j, T_map_scan)) {
    if (pair->i == i) return pair->measured->T_i_j;
  }
  for (const ScanMatch& match : matches_[j]) {
    if (match.chain.may_be_false) continue;
    for (const auto& [partner, T_i_scan] : match.T_i_scan) {
      if (partner == i) return T_i_scan;
    }
  }
  return std::nullopt;
}

}  // namespace strata
