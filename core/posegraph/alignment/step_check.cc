#include "core/posegraph/alignment/step_check.h"

#include <memory>
#include <span>
#include <utility>

#include "absl/status/status.h"

#include "core/common/status.h"
#include "core/registration/place_match.h"

namespace strata {
namespace {

// A scan fits where it is as well as anywhere if its fit has this share of the best (see LinkScan).
constexpr double kLeastShareOfBest = 0.9;
// What another one looked through more of is not there, glass and people apart.
constexpr double kMostContradiction = 0.1;
constexpr double kLeastOverlap = 0.5;
// One scan alone may see people, or much of what others do not.
constexpr int kLeastAgainst = 2;
// Fits nearer to each other are one.
constexpr double kOneFitM = 0.5;
constexpr double kOneFitRad = 0.05;

enum class StepWord { kFor, kAgainst, kNothing };

bool IsOneFit(const Pose& a, const Pose& b) {
  const Pose T_a_b = a.inverse() * b;
  return T_a_b.translation().norm() <= kOneFitM && RotationAngleRad(T_a_b) <= kOneFitRad;
}

// The scans, and what keeps alive what they point to.
struct SeenScans {
  std::vector<std::shared_ptr<const ScanFeatures>> held;
  std::vector<SeenScan> scans;
};

absl::StatusOr<SeenScans> SeenOf(const std::vector<std::size_t>& nodes,
                                 const std::vector<Pose>& T_map_scan,
                                 AlignmentSource& source) {
  SeenScans seen;
  for (const std::size_t node : nodes) {
    absl::StatusOr<std::shared_ptr<const ScanFeatures>> features = source.Features(node);
    if (absl::IsDataLoss(features.status())) continue;
    STRATA_RETURN_IF_ERROR(features.status());
    seen.held.push_back(*std::move(features));
    seen.scans.push_back({seen.held.back().get(), T_map_scan[node], source.SensorOrigin(node)});
  }
  return seen;
}

// What `scan` says of its place among those before the step.
StepWord WordOf(const SeenScan& scan,
                std::span<const SeenScan> before,
                const Pose& T_map_said,
                const PlaceMatchOptions& options) {
  const PlaceHypothesis here{scan.T_target_scan, 0.0, 0.0, 0.0};
  const PlaceMatch found = MatchPlace(scan, before, {&here, 1}, options);
  const bool stays = found.fit > 0.0 && IsOneFit(scan.T_target_scan, found.T_target_source);
  if (stays && found.contradiction > kMostContradiction) return StepWord::kAgainst;
  const PlaceHypothesis windows[] = {SaidHypothesis(scan.T_target_scan),
                                     SaidHypothesis(T_map_said)};
  const PlaceMatch best = MatchPlace(scan, before, windows, options);
  const bool fits_elsewhere = best.fit > 0.0 &&
                              !IsOneFit(scan.T_target_scan, best.T_target_source) &&
                              (!stays || found.fit < kLeastShareOfBest * best.fit);
  if (fits_elsewhere) return StepWord::kAgainst;
  const bool shows_it = found.overlap >= kLeastOverlap && best.rival < options.rival_share;
  return stays && shows_it ? StepWord::kFor : StepWord::kNothing;
}

}  // namespace

absl::StatusOr<bool> StepHolds(const DoubtfulStep& step,
                               const std::vector<Pose>& T_map_scan,
                               AlignmentSource& source,
                               const MlsRegistrationOptions& registration) {
  STRATA_ASSIGN_OR_RETURN(const SeenScans before, SeenOf(step.before, T_map_scan, source));
  STRATA_ASSIGN_OR_RETURN(const SeenScans after, SeenOf(step.after, T_map_scan, source));
  if (before.scans.empty() || after.scans.empty()) return true;
  PlaceMatchOptions options;
  options.registration = registration;
  int agreeing = 0;
  int against = 0;
  for (const SeenScan& scan : after.scans) {
    const StepWord word =
        WordOf(scan, before.scans, step.T_said_found * scan.T_target_scan, options);
    agreeing += word == StepWord::kFor ? 1 : 0;
    against += word == StepWord::kAgainst ? 1 : 0;
  }
  if (against < kLeastAgainst) return true;
  return against < agreeing || (step.is_verified && against == agreeing);
}

}  // namespace strata
