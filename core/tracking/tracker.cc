#include "core/tracking/tracker.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "core/common/status.h"
#include "core/posegraph/information.h"
#include "core/registration/place_match.h"
#include "core/registration/registration_result.h"

namespace strata {
namespace {

// What the map has of a scan at least, and what of the map a scan looks through at most.
constexpr double kLeastOverlap = 0.5;
constexpr double kMostContradiction = 0.25;
constexpr double kLeastClose = 0.7;
// What is close: in coarse maps a cell, for surfaces stand in the middle of theirs.
constexpr double kCloseM = 0.2;
constexpr double kMostCloseM = 0.5;
// χ² of 6 degrees of freedom that one good scan in a million exceeds: odometry may slip, and the
// map knows better.
constexpr double kGate = 38.3;
// Errors of neighbouring features are alike, so that thousands of them tell as much as so many,
// with errors of this σ along their normals,
constexpr double kIndependent = 100.0;
constexpr double kSurfaceSigmaM = 0.04;
// with others where it slides along its surfaces, half of it where this share of them holds it
// (what tangents weigh beside normals in MlsRegistrationOptions: 0.03² / 0.2²),
constexpr double kSlideM = 0.1;
constexpr double kHoldsHalf = 0.0225;
// of a scan's rotation,
constexpr double kMatchSigmaRad = 0.001;
// and of the map around, which no number of scans makes less, where they are measured that
// sharply (MapSurfaces::blur_m).
constexpr double kUsualBlurM = 0.1;
constexpr double kMapSigmaM = 0.015;
constexpr double kMapSigmaRad = 0.002;
// Those are of scans whose surfaces lie so far from the map's (root mean square), as among trees
// and on uneven ground; between walls there are smaller ones.
constexpr double kUsualRmsM = 0.12;
constexpr double kMostErrorScale = 3.0;
// A place that was found is left by no more than these when the scan is registered to the map.
constexpr double kSamePlaceM = 0.5;
constexpr double kSamePlaceRad = 0.1;
// A robot that stays lost is looked for with so many scans in a row, then with every so manieth.
constexpr int kSearchesInARow = 5;
constexpr int kScansPerSearch = 5;

bool Accepted(Termination termination) {
  return termination == Termination::kConverged || termination == Termination::kDegenerate;
}

// How large errors are beside those named above.
double ErrorScale(double rms_m) {
  return std::clamp(rms_m / kUsualRmsM, 1.0 / kMostErrorScale, kMostErrorScale);
}

// A scan is drawn along its surfaces to where it overlaps most (core/registration/sliding.h): the
// less so, the firmer others hold it. In the tangent's order, in units of its own.
Matrix6d SlidingCovariance(const Matrix6d& held) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(held.bottomRightCorner<3, 3>());
  const Eigen::Array3d sigma_m =
      kSlideM * kHoldsHalf / (kHoldsHalf + eigen.eigenvalues().array().max(0.0));
  Matrix6d covariance = kMatchSigmaRad * kMatchSigmaRad * Matrix6d::Identity();
  covariance.bottomRightCorner<3, 3>() = eigen.eigenvectors() *
                                         sigma_m.square().matrix().asDiagonal() *
                                         eigen.eigenvectors().transpose();
  return covariance;
}

// What a match says of the pose, where surfaces hold it as firmly as `held`; nothing along
// directions that it was not moved in. `scale` of the surfaces' errors.
Matrix6d InformationOf(const Matrix6d& held,
                       double scale,
                       const std::vector<Vector6d>& degenerate) {
  const double sigma_m = scale * kSurfaceSigmaM;
  Matrix6d information = LoosenedInformation(kIndependent / (sigma_m * sigma_m) * held,
                                             SlidingCovariance(held).inverse());
  for (const Vector6d& direction : degenerate) {
    const Vector6d d = direction.normalized();
    const Matrix6d without = Matrix6d::Identity() - d * d.transpose();
    information = without * information * without;
  }
  return information;
}

Matrix6d MapCovariance() {
  Vector6d variances;
  variances << Eigen::Vector3d::Constant(kMapSigmaRad * kMapSigmaRad),
      Eigen::Vector3d::Constant(kMapSigmaM * kMapSigmaM);
  return variances.asDiagonal();
}

}  // namespace

std::optional<Pose> Tracker::pose() const {
  if (!filter_.has_value()) return std::nullopt;
  return filter_->pose();
}

void Tracker::Move(const Pose& T_new_old) {
  if (filter_.has_value()) filter_->Move(T_new_old);
}

void Tracker::Predict(const TrackStep& step) {
  const std::optional<Pose> T_odom_last = std::exchange(T_odom_last_, step.T_odom_scan);
  if (!T_odom_last.has_value()) return;
  const Pose motion = Normalized(T_odom_last->inverse() * step.T_odom_scan);
  if (filter_.has_value()) {
    filter_->Predict(motion, step.motion_covariance.value_or(MotionCovariance(motion)));
  } else if (start_.T_map_scan_guess.has_value()) {
    start_.T_map_scan_guess = Normalized(*start_.T_map_scan_guess * motion);
  }
}

absl::StatusOr<Tracker::Look> Tracker::LookFrom(const Pose& T_map_scan_guess,
                                                const ScanFeatures& features,
                                                TrackedMap& map) const {
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<const MapSurfaces> surfaces,
                          map.Around(T_map_scan_guess.translation()));
  Look look;
  RegistrationResult match =
      RegisterScan(features, surfaces->target, T_map_scan_guess, registration_);
  if (match.termination == Termination::kMaxIterations ||
      match.termination == Termination::kDegenerate) {
    match = RegisterScan(features, surfaces->target, match.T_target_source, registration_);
  }
  if (!Accepted(match.termination)) {
    look.overlap = match.overlap;
    look.why_not = absl::StrCat("registration: ", ToString(match.termination));
    return look;
  }
  const MapAgreement agreement =
      AgreementWithMap({&features, match.T_target_source, features.sensor_origin()},
                       surfaces->features,
                       surfaces->target,
                       std::clamp(surfaces->blur_m, kCloseM, kMostCloseM));
  look.T_map_scan = match.T_target_source;
  const double scale = ErrorScale(match.rms_m);
  look.map_scale = scale * std::max(1.0, surfaces->blur_m / kUsualBlurM);
  look.information = InformationOf(agreement.held, scale, match.degenerate_directions);
  look.overlap = agreement.overlap;
  look.contradiction = agreement.contradiction;
  look.rms_m = match.rms_m;
  look.agrees = look.overlap >= kLeastOverlap && agreement.close >= kLeastClose &&
                look.contradiction <= kMostContradiction;
  if (!look.agrees) {
    look.why_not = absl::StrFormat("the map has %.0f %% of what it shows, it looks through %.0f %%",
                                   100.0 * look.overlap,
                                   100.0 * look.contradiction);
  }
  return look;
}

absl::StatusOr<Tracker::Look> Tracker::LookAhead(const ScanFeatures& features,
                                                 TrackedMap& map) const {
  STRATA_ASSIGN_OR_RETURN(Look look, LookFrom(filter_->pose(), features, map));
  if (!look.agrees) return look;
  const double innovation = filter_->InnovationOf(look.T_map_scan, look.information);
  if (innovation <= kGate) return look;
  const Pose off = filter_->pose().inverse() * look.T_map_scan;
  look.agrees = false;
  look.why_not = absl::StrFormat("%.2f m and %.3f rad from where odometry says, χ² %.0f",
                                 off.translation().norm(),
                                 RotationAngleRad(off),
                                 innovation);
  return look;
}

void Tracker::Believe(const Look& look) {
  filter_->Update(look.T_map_scan, look.information);
  map_scale_ = look.map_scale;
  misses_ = 0;
}

void Tracker::Tell(const Look& look, TrackedPose& pose) {
  pose.overlap = look.overlap;
  pose.contradiction = look.contradiction;
  pose.rms_m = look.rms_m;
  pose.message = look.why_not;
  if (!look.agrees) return;
  pose.state = TrackState::kTracked;
  pose.score = look.overlap * (1.0 - look.contradiction / kMostContradiction);
}

absl::StatusOr<bool> Tracker::TryPlace(const std::optional<Pose>& guess,
                                       double radius_m,
                                       const ScanFeatures& features,
                                       TrackedMap& map,
                                       TrackedPose& pose) {
  STRATA_ASSIGN_OR_RETURN(const LocalizeResult place, map.Find(guess, radius_m));
  if (!place.found) {
    pose.message = place.message;
    return false;
  }
  STRATA_ASSIGN_OR_RETURN(const Look look, LookFrom(place.best.T_map_scan, features, map));
  Tell(look, pose);
  const Pose off = place.best.T_map_scan.inverse() * look.T_map_scan;
  if (look.agrees &&
      (off.translation().norm() > kSamePlaceM || RotationAngleRad(off) > kSamePlaceRad)) {
    pose.state = TrackState::kLost;
    pose.score = 0.0;
    pose.message = "the place found is none by the map's surfaces";
  }
  if (pose.state != TrackState::kTracked) return false;
  filter_.emplace(place.best.T_map_scan, place.covariance);
  Believe(look);
  pose.found = true;
  pose.message = place.message;
  return true;
}

absl::StatusOr<bool> Tracker::FindAgain(const ScanFeatures& features,
                                        TrackedMap& map,
                                        TrackedPose& pose) {
  pose.state = TrackState::kLost;
  if (!filter_.has_value()) {
    return TryPlace(start_.T_map_scan_guess, start_.guess_radius_m, features, map, pose);
  }
  const double sigma_m = std::sqrt(filter_->Covariance().diagonal().tail<3>().maxCoeff());
  if (3.0 * sigma_m < start_.guess_radius_m) {
    const double radius_m = std::max(3.0 * sigma_m, kSamePlaceM);
    STRATA_ASSIGN_OR_RETURN(const bool found,
                            TryPlace(filter_->pose(), radius_m, features, map, pose));
    if (found) return true;
    pose.state = TrackState::kLost;
  }
  return TryPlace(std::nullopt, start_.guess_radius_m, features, map, pose);
}

bool Tracker::ToBeLookedFor() const {
  const int searches = misses_ - (filter_.has_value() ? kMissesUntilLost : 1);
  return searches >= 0 && (searches < kSearchesInARow || searches % kScansPerSearch == 0);
}

TrackedPose Tracker::Answer(TrackedPose pose) const {
  pose.known = filter_.has_value();
  if (!pose.known) return pose;
  pose.T_map_scan = filter_->pose();
  pose.covariance = filter_->Covariance() + map_scale_ * map_scale_ * MapCovariance();
  return pose;
}

absl::StatusOr<TrackedPose> Tracker::Step(const TrackStep& step,
                                          const ScanFeatures& features,
                                          TrackedMap& map) {
  Predict(step);
  TrackedPose pose;
  if (filter_.has_value() && misses_ < kMissesUntilLost) pose.state = TrackState::kPredicted;
  if (features.size() == 0) {
    pose.message = "no points: by odometry alone";
    return Answer(pose);
  }
  if (filter_.has_value()) {
    STRATA_ASSIGN_OR_RETURN(const Look look, LookAhead(features, map));
    Tell(look, pose);
    if (look.agrees) {
      Believe(look);
      return Answer(pose);
    }
  }
  ++misses_;
  if (filter_.has_value() && misses_ >= kMissesUntilLost) pose.state = TrackState::kLost;
  if (!ToBeLookedFor()) return Answer(pose);
  STRATA_RETURN_IF_ERROR(FindAgain(features, map, pose).status());
  return Answer(pose);
}

}  // namespace strata
