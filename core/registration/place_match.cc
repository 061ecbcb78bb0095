#include "core/registration/place_match.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "core/common/option_checks.h"
#include "core/common/random.h"
#include "core/mls/features.h"
#include "core/registration/column_grid.h"
#include "core/registration/place_search.h"
#include "core/registration/registration_target.h"
#include "core/registration/upright_frame.h"
#include "core/registration/view_check.h"

namespace strata {
namespace {

// What is compared of a scan.
constexpr std::uint32_t kComparedOfClass = 1000;
constexpr float kComparedRangeM = 30.0F;  // beyond, a scan is too sparse to have every partner
constexpr float kPartnerM = 0.5F;
constexpr int kMinCompared = 50;
// Glass and wet roads return nothing though they are there.
constexpr double kNoReturnCounts = 0.5;
// Contradictions make a fit worse by e for each of this.
constexpr double kContradictionScale = 0.05;
constexpr double kTiltMatters = 0.03;
// How far off frames are that are said to be one.
constexpr double kSaidRadiusM = 5.0;
constexpr double kSaidHeightM = 1.5;
constexpr double kSaidHeadingRad = 0.4;

// Counts over the features of one scan that another one could see at the pose.
struct Comparison {
  int seen_through = 0;
  int no_return = 0;
  int visible = 0;
  struct Share {
    int found = 0;  // with a partner in the other
    int all = 0;
  };
  Share level;
  Share upright;

  double Contradiction() const {
    const int all = visible + no_return;
    return all > 0 ? (seen_through + kNoReturnCounts * no_return) / all : 0.0;
  }
  // Ground fits in many places, walls do not: each counts half, whatever their numbers.
  double Overlap() const {
    const auto of = [](const Share& s) { return static_cast<double>(s.found) / s.all; };
    if (level.all < kMinCompared && upright.all < kMinCompared) return 0.0;
    if (level.all < kMinCompared) return of(upright);
    if (upright.all < kMinCompared) return of(level);
    return std::sqrt(of(level) * of(upright));
  }
};

// Adds what `image` says of a point, in the image's frame.
Sight Look(const Eigen::Vector3f& p_image, bool upright, const ViewImage& image, Comparison& sum) {
  const Sight sight = image.At(p_image, !upright);
  sum.no_return += sight == Sight::kNoReturn ? 1 : 0;
  sum.seen_through += sight == Sight::kSeenThrough ? 1 : 0;
  sum.visible += sight == Sight::kSeenThrough || sight == Sight::kAgreeing ? 1 : 0;
  return sight;
}

// A registered start and how well it fits.
struct Fit {
  RegistrationResult registration;
  double overlap = 0.0;
  double contradiction = 0.0;
  double score() const { return overlap * std::exp(-contradiction / kContradictionScale); }
};

struct SampledPoint {
  Eigen::Vector3f p;
  bool upright;
};

// Of what is near `centre`.
std::vector<SampledPoint> SampleOf(const ScanFeatures& features,
                                   const Eigen::Vector3f& centre = Eigen::Vector3f::Zero()) {
  std::vector<SampledPoint> sample;
  SplitMix64 random(1);
  for (const auto c :
       {FeatureClass::kTraversable, FeatureClass::kNonTraversable, FeatureClass::kVertical}) {
    const std::vector<Eigen::Vector3f>& points = features.points(c);
    std::vector<Eigen::Vector3f> near;
    std::copy_if(points.begin(), points.end(), std::back_inserter(near), [&](const auto& p) {
      return (p - centre).norm() <= kComparedRangeM;
    });
    for (const std::uint32_t i :
         SampleIndices(static_cast<std::uint32_t>(near.size()), kComparedOfClass, random)) {
      sample.push_back({near[i], c == FeatureClass::kVertical});
    }
  }
  return sample;
}

bool HasPartner(const Eigen::Vector3f& p,
                const RegistrationTarget& grids,
                float within_m = kPartnerM) {
  for (const auto c :
       {FeatureClass::kTraversable, FeatureClass::kNonTraversable, FeatureClass::kVertical}) {
    if (grids.grid(c).Nearest(p, within_m) != ColumnGrid::kNone) return true;
  }
  return false;
}

// Whether it has a partner.
bool Count(const SampledPoint& point,
           const Eigen::Isometry3f& to_grid,
           const RegistrationTarget& grids,
           float within_m,
           Comparison& sum) {
  Comparison::Share& share = point.upright ? sum.upright : sum.level;
  const bool found = HasPartner(to_grid * point.p, grids, within_m);
  ++share.all;
  share.found += found ? 1 : 0;
  return found;
}

// Adds what `image` and the features `grids` of the other side say about `points`.
void Compare(const std::vector<SampledPoint>& points,
             const Pose& T_image_points,
             const ViewImage& image,
             const Pose& T_grid_points,
             const RegistrationTarget& grids,
             Comparison& sum) {
  const Eigen::Isometry3f to_image = T_image_points.cast<float>();
  const Eigen::Isometry3f to_grid = T_grid_points.cast<float>();
  for (const SampledPoint& point : points) {
    const Eigen::Vector3f p_image = to_image * point.p;
    const Sight sight = Look(p_image, point.upright, image, sum);
    if (sight == Sight::kUnknown || sight == Sight::kNoReturn) continue;
    if (p_image.norm() > kComparedRangeM) continue;
    Count(point, to_grid, grids, kPartnerM, sum);
  }
}

bool Accepted(Termination termination) {
  return termination == Termination::kConverged || termination == Termination::kMaxIterations ||
         termination == Termination::kDegenerate;
}

double TiltRad(const Pose& T) { return std::acos(std::clamp(T.linear()(2, 2), -1.0, 1.0)); }

class Matcher {
 public:
  Matcher(const SeenScan& source,
          std::span<const SeenScan> target,
          const Eigen::Vector3d& centre,
          double window_m,
          const PlaceMatchOptions& options)
      : options_(options),
        source_(*source.features),
        T_upright_source_(UprightTurn(source_.up())),
        target_(Placed(target), {.radius_m = options.radius_m + window_m, .centre = centre}),
        search_(source_, target_),
        source_view_(source_, source.sensor_origin),
        source_sample_(SampleOf(source_)) {
    const PlacedScan alone[] = {{&source_, Pose::Identity()}};
    source_grids_ = RegistrationTarget(alone, {});
    for (const SeenScan& scan : target) {
      views_.push_back({ViewImage(*scan.features, scan.sensor_origin),
                        SampleOf(*scan.features),
                        scan.T_target_scan});
    }
  }

  void Try(const PlaceHypothesis& hypothesis, std::vector<Fit>& fits) const {
    std::vector<Pose> starts = {hypothesis.T_target_source};
    PlaceHypothesis upright = hypothesis;
    upright.T_target_source = hypothesis.T_target_source * T_upright_source_.inverse();
    const Eigen::Matrix3d& R = upright.T_target_source.linear();
    const double tilt = TiltRad(upright.T_target_source);
    const Eigen::AngleAxisd untilted(std::atan2(R(1, 0), R(0, 0)), Eigen::Vector3d::UnitZ());
    for (const CoarsePlace& place :
         search_.Search(upright, static_cast<std::size_t>(options_.max_starts))) {
      starts.push_back(place.T_target_upright * T_upright_source_);
      if (tilt < kTiltMatters) continue;
      Pose tilted = place.T_target_upright;
      tilted.linear() = tilted.linear() * untilted.inverse() * R;
      starts.push_back(tilted * T_upright_source_);
    }
    for (const Pose& start : starts) {
      if (std::optional<Fit> fit = FitFrom(start); fit.has_value()) fits.push_back(*fit);
    }
  }

  // How firmly the surfaces of both hold the pose along its loosest horizontal direction: the mean
  // of (n · d)² over the matched features with a normal n.
  double Hold(const Pose& T_target_source) const {
    Pose T = T_target_source;
    T.translation() -= target_.origin();
    const Eigen::Isometry3f to_grid = T.cast<float>();
    Eigen::Matrix2d held = Eigen::Matrix2d::Zero();
    int count = 0;
    for (const SampledFeature& feature : source_.sample()) {
      const Eigen::Vector3f& p = feature.element.point;
      const Eigen::Vector3f n = T_upright_source_.linear().cast<float>() * feature.element.normal;
      if (n.isZero() || p.norm() > kComparedRangeM) continue;
      if (!HasPartner(to_grid * p, target_)) continue;
      const Eigen::Vector2d across = n.head<2>().cast<double>();
      held += across * across.transpose();
      ++count;
    }
    if (count == 0) return 0.0;
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(held).eigenvalues()[0] / count;
  }

 private:
  struct View {
    ViewImage image;
    std::vector<SampledPoint> sample;
    Pose T_target_scan;
  };

  static std::vector<PlacedScan> Placed(std::span<const SeenScan> target) {
    std::vector<PlacedScan> placed;
    for (const SeenScan& scan : target) placed.push_back({scan.features, scan.T_target_scan});
    return placed;
  }

  std::optional<Fit> FitFrom(const Pose& start) const {
    Fit fit;
    fit.registration = RegisterScan(source_, target_, start, options_.registration);
    if (!Accepted(fit.registration.termination)) return std::nullopt;
    Check(fit);
    return fit;
  }

  // Looks from the source at the target's scans and back.
  void Check(Fit& fit) const {
    const Pose T_source_target = fit.registration.T_target_source.inverse();
    Comparison forth;
    Comparison back;
    for (const View& view : views_) {
      const Pose T_source_scan = T_source_target * view.T_target_scan;
      Compare(view.sample, T_source_scan, source_view_, T_source_scan, source_grids_, forth);
      Pose T_grid_source = fit.registration.T_target_source;
      T_grid_source.translation() -= target_.origin();
      Compare(source_sample_, T_source_scan.inverse(), view.image, T_grid_source, target_, back);
    }
    fit.contradiction = std::max(forth.Contradiction(), back.Contradiction());
    fit.overlap = std::min(forth.Overlap(), back.Overlap());
  }

  const PlaceMatchOptions& options_;
  const ScanFeatures& source_;
  const Pose T_upright_source_;
  RegistrationTarget target_;
  PlaceSearch search_;
  ViewImage source_view_;
  std::vector<SampledPoint> source_sample_;
  RegistrationTarget source_grids_;
  std::vector<View> views_;
};

// MapAgreement::held.
Matrix6d HeldBy(const ScanFeatures& features,
                const Eigen::Isometry3f& to_grid,
                const RegistrationTarget& target) {
  Matrix6d held = Matrix6d::Zero();
  int count = 0;
  for (const SampledFeature& feature : features.sample()) {
    const SurfaceElement& element = feature.element;
    if (element.normal.isZero()) continue;
    const ColumnGrid& grid = target.grid(feature.feature_class);
    if (grid.Nearest(to_grid * element.point, kPartnerM) == ColumnGrid::kNone) continue;
    const Eigen::Vector3d n = element.normal.cast<double>();
    Vector6d slope;  // of the distance along the normal
    slope << element.point.cast<double>().cross(n), n;
    held.selfadjointView<Eigen::Lower>().rankUpdate(slope);
    ++count;
  }
  if (count == 0) return held;
  held.triangularView<Eigen::StrictlyUpper>() = held.transpose();
  return held / count;
}

bool SamePlace(const Pose& a, const Pose& b, const PlaceMatchOptions& options) {
  const Pose T_a_b = a.inverse() * b;
  return T_a_b.translation().norm() <= options.same_place_m &&
         RotationAngleRad(T_a_b) <= options.same_place_rad;
}

PlaceVerdict VerdictOn(const Fit& fit,
                       double hold,
                       double rival,
                       const PlaceMatchOptions& options) {
  if (fit.overlap < options.min_overlap) return PlaceVerdict::kNoFit;
  // The registration alone does not see it: to its metric a surface's points hold along it too.
  if (fit.registration.termination == Termination::kDegenerate || hold < options.min_hold) {
    return PlaceVerdict::kDegenerate;
  }
  if (fit.contradiction > options.max_contradiction) return PlaceVerdict::kContradicted;
  return rival >= options.rival_share ? PlaceVerdict::kAmbiguous : PlaceVerdict::kMatched;
}

// MatchPlace() in a target frame whose z axis is the vertical.
PlaceMatch MatchUpright(const SeenScan& source,
                        std::span<const SeenScan> target,
                        std::span<const PlaceHypothesis> hypotheses,
                        const PlaceMatchOptions& options) {
  PlaceMatch match;
  if (hypotheses.empty() || target.empty()) return match;
  match.T_target_source = hypotheses[0].T_target_source;
  double window_m = 0.0;
  for (const PlaceHypothesis& hypothesis : hypotheses) {
    const double apart =
        (hypothesis.T_target_source.translation() - match.T_target_source.translation()).norm();
    window_m = std::max(window_m, apart + hypothesis.radius_m);
  }
  const Matcher matcher(source, target, match.T_target_source.translation(), window_m, options);
  std::vector<Fit> fits;
  for (const PlaceHypothesis& hypothesis : hypotheses) matcher.Try(hypothesis, fits);
  if (fits.empty()) return match;
  const Fit& best = *std::max_element(
      fits.begin(), fits.end(), [](const Fit& a, const Fit& b) { return a.score() < b.score(); });
  for (const Fit& fit : fits) {
    if (SamePlace(fit.registration.T_target_source, best.registration.T_target_source, options) ||
        best.score() <= 0.0) {
      continue;
    }
    match.rival = std::max(match.rival, fit.score() / best.score());
  }
  match.hold = matcher.Hold(best.registration.T_target_source);
  match.T_target_source = best.registration.T_target_source;
  match.information = best.registration.information;
  match.rms_m = best.registration.rms_m;
  match.overlap = best.overlap;
  match.contradiction = best.contradiction;
  match.fit = best.score();
  match.verdict = VerdictOn(best, match.hold, match.rival, options);
  if (match.matched() && options.max_contradiction > 0.0) {
    match.confidence = match.overlap * (1.0 - match.contradiction / options.max_contradiction) *
                       (1.0 - match.rival);
  }
  return match;
}

}  // namespace

PlaceHypothesis SaidHypothesis(const Pose& T_target_source) {
  return {T_target_source, kSaidRadiusM, kSaidHeightM, kSaidHeadingRad};
}

bool IsWithin(const Pose& T_target_source, const PlaceHypothesis& window) {
  const Eigen::Vector3d off = T_target_source.translation() - window.T_target_source.translation();
  const Eigen::Matrix3d turn =
      T_target_source.linear() * window.T_target_source.linear().transpose();
  return off.head<2>().norm() <= window.radius_m && std::abs(off.z()) <= window.height_range_m &&
         std::abs(std::atan2(turn(1, 0), turn(0, 0))) <= window.heading_range_rad;
}

std::vector<PlaceHypothesis> HypothesesOf(const PlaceSimilarity& similarity,
                                          const Eigen::Matrix3d& R_upright_target,
                                          const Eigen::Matrix3d& R_upright_source) {
  std::vector<PlaceHypothesis> hypotheses(2);
  for (int half_turns = 0; half_turns < 2; ++half_turns) {
    const Eigen::AngleAxisd turn(similarity.heading_rad + half_turns * std::numbers::pi,
                                 Eigen::Vector3d::UnitZ());
    hypotheses[static_cast<std::size_t>(half_turns)].T_target_source.linear() =
        R_upright_target.transpose() * turn * R_upright_source;
  }
  return hypotheses;
}

absl::string_view ToString(PlaceVerdict verdict) {
  switch (verdict) {
    case PlaceVerdict::kMatched:
      return "matched";
    case PlaceVerdict::kNoFit:
      return "no fit";
    case PlaceVerdict::kDegenerate:
      return "degenerate";
    case PlaceVerdict::kContradicted:
      return "contradicted";
    case PlaceVerdict::kAmbiguous:
      return "ambiguous";
  }
  return "unknown";
}

absl::Status PlaceMatchOptions::Validate() const {
  OptionChecks checks("place match options");
  checks.InRange("max_starts", max_starts, 1, 100);
  checks.InRange("radius_m", radius_m, 5.0, 200.0);
  checks.InRange("min_overlap", min_overlap, 0.0, 1.0);
  checks.InRange("max_contradiction", max_contradiction, 0.0, 1.0);
  checks.InRange("min_hold", min_hold, 0.0, 0.5);
  checks.InRange("rival_share", rival_share, 0.0, 1.0);
  checks.InRange("same_place_m", same_place_m, 1e-3, 100.0);
  checks.InRange("same_place_rad", same_place_rad, 1e-3, 3.15);
  if (!checks.status().ok()) return checks.status();
  return registration.Validate();
}

double ContradictionOf(const SeenScan& a, const SeenScan& b) {
  const auto seen = [](const SeenScan& looked_at, const SeenScan& looking) {
    const ViewImage image(*looking.features, looking.sensor_origin);
    const Pose T = looking.T_target_scan.inverse() * looked_at.T_target_scan;
    const Eigen::Isometry3f to_image = T.cast<float>();
    Comparison sum;
    for (const SampledPoint& point : SampleOf(*looked_at.features)) {
      Look(to_image * point.p, point.upright, image, sum);
    }
    return sum.Contradiction();
  };
  return std::max(seen(a, b), seen(b, a));
}

MapAgreement AgreementWithMap(const SeenScan& scan,
                              const ScanFeatures& surfaces,
                              const RegistrationTarget& target,
                              double close_m) {
  const ScanFeatures& features = *scan.features;
  Pose T_grid_scan = scan.T_target_scan;
  T_grid_scan.translation() -= target.origin();
  const Eigen::Isometry3f to_grid = T_grid_scan.cast<float>();
  const Eigen::Isometry3f to_scan = T_grid_scan.inverse().cast<float>();
  const ViewImage view(features, scan.sensor_origin);
  Comparison seen;
  for (const SampledPoint& point : SampleOf(surfaces, to_grid.translation())) {
    Look(to_scan * point.p, point.upright, view, seen);
  }
  Comparison near;
  Comparison close;
  for (const SampledPoint& point : SampleOf(features)) {
    const bool has_partner = Count(point, to_grid, target, kPartnerM, near);
    if (has_partner) Count(point, to_grid, target, static_cast<float>(close_m), close);
  }
  return {near.Overlap(), close.Overlap(), seen.Contradiction(), HeldBy(features, to_grid, target)};
}

PlaceMatch MatchPlace(const SeenScan& source,
                      std::span<const SeenScan> target,
                      std::span<const PlaceHypothesis> hypotheses,
                      const PlaceMatchOptions& options) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const SeenScan& scan : target) up += scan.T_target_scan.linear() * scan.features->up();
  if (up.isZero()) return PlaceMatch();
  const Pose T_upright_target(UprightTurn(up));
  std::vector<SeenScan> upright(target.begin(), target.end());
  for (SeenScan& scan : upright) scan.T_target_scan = T_upright_target * scan.T_target_scan;
  std::vector<PlaceHypothesis> windows(hypotheses.begin(), hypotheses.end());
  for (PlaceHypothesis& window : windows) {
    window.T_target_source = T_upright_target * window.T_target_source;
  }
  PlaceMatch match = MatchUpright(source, upright, windows, options);
  match.T_target_source = T_upright_target.inverse() * match.T_target_source;
  return match;
}

std::optional<std::size_t> UniquePlace(std::span<const PlaceMatch> matches,
                                       const PlaceMatchOptions& options) {
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!matches[i].matched()) continue;
    if (!best.has_value() || matches[i].confidence > matches[*best].confidence) best = i;
  }
  if (!best.has_value()) return std::nullopt;
  for (const PlaceMatch& other : matches) {
    if (other.verdict == PlaceVerdict::kNoFit || other.verdict == PlaceVerdict::kContradicted) {
      continue;
    }
    if (SamePlace(other.T_target_source, matches[*best].T_target_source, options)) continue;
    if (other.overlap >= options.rival_share * matches[*best].overlap) return std::nullopt;
  }
  return best;
}

}  // namespace strata
