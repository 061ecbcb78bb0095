// Does this scan show that place, and where exactly was it taken? Verifies a guess that may be
// wrong altogether: for loop closing and for finding oneself in a map. A wrong match costs more
// than a missed one, so everything doubtful is refused, with the reason.
//
//   const SeenScan there[] = {{&features_of_i, T_map_i}, …};   // the place, in the target frame
//   const PlaceHypothesis guess{T_map_i * T_i_j_guess, 12.0, 3.0, 0.3};
//   const PlaceMatch match = MatchPlace({&features_of_j}, there, {&guess, 1});
//   if (match.matched()) …
#ifndef STRATA_CORE_REGISTRATION_PLACE_MATCH_H_
#define STRATA_CORE_REGISTRATION_PLACE_MATCH_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>

#include "core/geometry/pose.h"
#include "core/registration/mls_registration.h"
#include "core/registration/place_descriptor.h"
#include "core/registration/registration_target.h"
#include "core/registration/scan_features.h"

namespace strata {

// A scan, where it is in the target frame (the source: ignored), and where its sensor was within
// it.
struct SeenScan {
  const ScanFeatures* features = nullptr;  // not null; used during the call only
  Pose T_target_scan = Pose::Identity();
  Eigen::Vector3d sensor_origin = Eigen::Vector3d::Zero();  // scan frame
};

// A window to search, around a guess. Only the heading of the guess is searched around; its tilt is
// tried as it is, and upright.
struct PlaceHypothesis {
  Pose T_target_source = Pose::Identity();
  double radius_m = 15.0;          // horizontally; in [0, 200]
  double height_range_m = 3.0;     // up and down; in [0, 1000]
  double heading_range_rad = 0.1;  // to both sides; in [0, π], π: any heading
};

// Around where the frames of two robots say the source is, as far off as such frames are.
PlaceHypothesis SaidHypothesis(const Pose& T_target_source);
// Whether a pose lies in the window. The target's z axis is the vertical.
bool IsWithin(const Pose& T_target_source, const PlaceHypothesis& window);

// The two headings that a descriptor's comparison leaves (a: the target, b: the source), each
// upright by how it is turned from its scan's frame (UprightTurn), with the default window.
std::vector<PlaceHypothesis> HypothesesOf(const PlaceSimilarity& similarity,
                                          const Eigen::Matrix3d& R_upright_target,
                                          const Eigen::Matrix3d& R_upright_source);

enum class PlaceVerdict {
  kMatched,
  kNoFit,         // no start converged with enough overlap
  kDegenerate,    // fits, but may slide along something: a corridor, an open field
  kContradicted,  // fits, but one scan looked through what the other one saw
  kAmbiguous,     // fits nearly as well elsewhere within the windows
};
// "matched", "no fit", "degenerate", "contradicted", "ambiguous".
absl::string_view ToString(PlaceVerdict verdict);

struct PlaceMatchOptions {
  MlsRegistrationOptions registration;  // of the last, exact step
  int max_starts = 6;                   // exact registrations tried; in [1, 100]
  double radius_m = 60.0;               // features farther from the sensor are left out; [5, 200]
  // Refused below: the smaller of the two shares of features that have a partner, among those that
  // both scans could see. In [0, 1].
  double min_overlap = 0.7;
  // Refused above; see PlaceMatch::contradiction. In [0, 1].
  double max_contradiction = 0.045;
  // Degenerate below; see PlaceMatch::hold. In [0, 0.5].
  double min_hold = 0.015;
  // Ambiguous when the best fit elsewhere reaches this share of the best fit; in [0, 1].
  double rival_share = 0.75;
  // Fits nearer to each other than both are the same.
  double same_place_m = 1.0;
  double same_place_rad = 0.1;

  absl::Status Validate() const;
};

struct PlaceMatch {
  PlaceVerdict verdict = PlaceVerdict::kNoFit;
  // The best fit, whatever the verdict (kNoFit: of the first hypothesis).
  Pose T_target_source = Pose::Identity();
  Matrix6d information = Matrix6d::Zero();  // as RegistrationResult::information
  double rms_m = 0.0;
  double overlap = 0.0;  // the smaller of both directions, in [0, 1]
  // Share of the features the other side looked at that it looked through, and half the share of
  // near ones where it looked and nothing came back; the larger of both directions.
  double contradiction = 0.0;
  // overlap · e^(−contradiction / 0.05): what fits are ordered by; 0 if none converged.
  double fit = 0.0;
  // Mean of (n · d)² over the matched surfaces' normals n, d being the horizontal direction in
  // which it is least: how firmly the match is held where it may slide most. A corridor has 0.007
  // at most.
  double hold = 0.0;
  double rival = 0.0;  // fit of the best one elsewhere / of this one, in [0, 1]
  // overlap · (1 − contradiction / max_contradiction) · (1 − rival), limited to [0, 1]: how much of
  // what can be checked speaks for this pose and no other; 0 for every verdict but kMatched. An
  // order, not a probability.
  double confidence = 0.0;

  bool matched() const { return verdict == PlaceVerdict::kMatched; }
};

// PlaceMatch::contradiction of two scans where they are, 0 if neither looked to where the other saw
// anything. A pure function; costs some ms.
double ContradictionOf(const SeenScan& a, const SeenScan& b);

// How well a scan at a pose agrees with a map that many scans have made, of which nobody knows
// which saw what. Shares count level and upright features alike, whatever their numbers: ground
// fits in many places, walls do not. 0 where there is too little to compare.
struct MapAgreement {
  double overlap = 0.0;  // share of what the scan shows within 30 m that the map has, in [0, 1]
  double close = 0.0;    // share of that which is within `close_m`, in [0, 1]
  // Share of what of the map the scan should see that it looked through, as PlaceMatch's.
  double contradiction = 0.0;
  // Mean over the scan's sampled features with a partner of g gᵀ, g being the slope of the distance
  // along their normal over a right-hand step on the scan's pose: what surfaces hold of it, and
  // where it may slide.
  Matrix6d held = Matrix6d::Zero();
};
// `surfaces` of the map are in the coordinates of the grids of `target`, which is made of them;
// `close_m` in (0, 0.5]. A pure function; costs some ms.
MapAgreement AgreementWithMap(const SeenScan& scan,
                              const ScanFeatures& surfaces,
                              const RegistrationTarget& target,
                              double close_m);

// The best fit of `source` to the scans of `target` within the windows: images of both from above
// are searched for the best starts, each start is registered exactly, and the fits are compared and
// checked both ways. A pure function of its arguments and their order. Costs some ten ms and some
// ms a start, more for windows above 20 m or with every heading. REQUIRES: valid options, finite
// poses.
PlaceMatch MatchPlace(const SeenScan& source,
                      std::span<const SeenScan> target,
                      std::span<const PlaceHypothesis> hypotheses,
                      const PlaceMatchOptions& options = {});

// Which of several matches of one scan, all in one target frame, is the place: the matched one with
// the highest confidence, or none where another one says differently (by more than `options` let
// the same place differ) and has overlap of at least `rival_share` of it. Storeys that look alike
// are told apart by nothing else.
std::optional<std::size_t> UniquePlace(std::span<const PlaceMatch> matches,
                                       const PlaceMatchOptions& options = {});

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_PLACE_MATCH_H_
