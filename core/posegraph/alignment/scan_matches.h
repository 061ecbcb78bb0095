// What alignment measures: every scan registered to the chains of scans around it, at the poses of
// a round, and kept from round to round as long as these hardly change (thesis 7.3.4, 7.4.3).
// Internal to core/posegraph, not installed.
#ifndef STRATA_CORE_POSEGRAPH_ALIGNMENT_SCAN_MATCHES_H_
#define STRATA_CORE_POSEGRAPH_ALIGNMENT_SCAN_MATCHES_H_

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/posegraph/alignment/alignment.h"
#include "core/posegraph/alignment/scan_chains.h"
#include "core/registration/scan_features.h"

namespace strata {

// A match is recorded as relative poses to the nearest few.
inline constexpr std::size_t kMaxPartners = 3;

// A scan registered to a chain of scans.
struct ScanMatch {
  ScanChain chain;
  bool tried = false;  // not where data are damaged
  bool good = false;
  // T_i_scan as measured, i being scans of the chain, nearest first.
  std::vector<std::pair<std::size_t, Pose>> T_i_scan;
  Matrix6d information = Matrix6d::Zero();  // of the match, to be shared by all of them
  // One that may be false, or of a lost scan, and leaves a direction to odometry.
  bool joins_nothing = false;

  // Of each of T_i_scan.
  Matrix6d Share() const { return information / static_cast<double>(T_i_scan.size()); }
};

// True if what is known of a scan leaves a direction to its odometry; false where that is nullptr.
bool Slides(const RelativePoseTerm* odometry, const Matrix6d& information);

// `information` of a registration, which is no better than `options` say.
Matrix6d LoosenedBy(const AlignmentOptions& options, const Matrix6d& information);

// True if a and b differ by no more.
bool Near(const Pose& a, const Pose& b, double distance_m, double turn_rad);

class ScanMatches {
 public:
  // Keeps references.
  ScanMatches(const AlignmentProblem& problem,
              AlignmentSource& source,
              const AlignmentOptions& options);

  // Registers every scan at these poses, in any number of threads with the same result, but where a
  // match of the call before still holds. Fills in the round's numbers of matches.
  absl::Status Register(std::span<const Pose> T_map_scan,
                        ForEach for_each,
                        const Stop& stop,
                        AlignmentRound& round);
  const std::vector<ScanMatch>& of(std::size_t node) const { return matches_[node]; }
  // Of every node: whether neither a match to what is behind it nor anything given tells its place.
  const std::vector<bool>& loose() const { return loose_; }
  // What was measured when scan `node` came in, if at these poses it still tells where the scan is
  // on its own way; empty if not.
  std::span<const ScanPair* const> MeasuredInForce(std::size_t node,
                                                   std::span<const Pose> T_map_scan) const;
  // T_i_j as registration has it.
  std::optional<Pose> Motion(std::size_t i, std::size_t j, std::span<const Pose> T_map_scan) const;
  // To be told when pairs or trajectories of the problem are others.
  void ProblemChanged();

 private:
  absl::StatusOr<std::size_t> RegisterNode(std::size_t node, std::span<const Pose> T_map_scan);
  absl::StatusOr<ScanMatch> RegisterTo(std::size_t node,
                                       ScanChain chain,
                                       std::span<const Pose> T_map_scan);
  absl::StatusOr<std::shared_ptr<const ScanFeatures>> FeaturesOf(std::size_t node);
  void FindLoose(std::span<const Pose> T_map_scan);

  const AlignmentProblem& problem_;
  AlignmentSource& source_;
  const AlignmentOptions& options_;
  ScanChains chains_;
  std::vector<std::vector<ScanMatch>> matches_;         // of every node
  std::vector<std::vector<const ScanPair*>> measured_;  // of every node j
  std::vector<const RelativePoseTerm*> odometry_;       // of every node j; nullptr: none
  std::vector<bool> lost_;                              // of every node
  std::vector<bool> loose_;                             // of every node, in the round before
};

}  // namespace strata

#endif  // STRATA_CORE_POSEGRAPH_ALIGNMENT_SCAN_MATCHES_H_
