#include "core/engine/ingest/link.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"

#include "core/engine/scans/matching.h"
#include "core/registration/mls_registration.h"
#include "core/registration/registration_target.h"

namespace strata {
namespace {

// Within these of the guess, registration and the robot say the same.
constexpr double kSameM = 0.3;
constexpr double kSameRad = 0.05;
// What is searched for a place: the nearest few.
constexpr std::size_t kPlaceScans = 5;
// A place that is not about where the robot says has more to say for itself: below, some are the
// next room, or the next corner of the yard.
constexpr double kLeastConfidence = 0.25;
constexpr double kAboutM = 1.0;
constexpr double kAboutRad = 0.1;
// Where so little of two scans overlaps, nothing may speak against their place: wrong ones drawn
// were contradicted by 0.08 and more; some right ones are lost by it.
constexpr double kLittleOverlap = 0.3;
constexpr double kLittleContradiction = 0.02;
// What may slide along surfaces fits nearly as well all along them: where something within reach
// fits better than this, the scan was not taken here. Of 51 drawn that slide and were right two had
// less than 0.95, both contradicted by 0.06 and more.
constexpr double kLeastShareOfBest = 0.9;
// What slides is left where the robot says, and then seems to say the same: no robot is taken to be
// better.
constexpr double kLeastSigmaM = 0.02;
constexpr double kLeastSigmaRad = 0.003;
// Scans of another pass show the same at least to this share.
constexpr double kLeastAgreement = 0.5;

bool AreWithin(const Pose& a, const Pose& b, double metres, double radians) {
  const Pose T_a_b = a.inverse() * b;
  return T_a_b.translation().norm() <= metres && RotationAngleRad(T_a_b) <= radians;
}

bool Same(const Pose& a, const Pose& b) { return AreWithin(a, b, kSameM, kSameRad); }

bool IsSure(const PlaceMatch& place, const Pose& guess, Nearness nearness) {
  if (!place.matched()) return false;
  const bool is_about = nearness == Nearness::kSamePass &&
                        AreWithin(place.T_target_source, guess, kAboutM, kAboutRad);
  return is_about || place.confidence >= kLeastConfidence;
}

bool Accepted(Termination termination) {
  return termination == Termination::kConverged || termination == Termination::kMaxIterations ||
         termination == Termination::kDegenerate;
}

Link LinkOf(const RegistrationResult& match) {
  Link link;
  link.report.aligned = true;
  link.report.message = std::string(ToString(match.termination));
  link.report.overlap = match.overlap;
  link.report.rms_m = match.rms_m;
  link.report.iterations = static_cast<std::uint32_t>(match.iterations);
  link.T_map_scan = Normalized(match.T_target_source);
  link.information = match.information;
  return link;
}

RegistrationResult Register(const SeenScan& scan,
                            std::span<const SeenScan> around,
                            const Pose& guess,
                            const std::optional<OdometryNoise>& noise = {}) {
  std::vector<PlacedScan> placed;
  for (const SeenScan& other : around) placed.push_back({other.features, other.T_target_scan});
  const RegistrationTarget target(placed, TargetOptions{.centre = guess.translation()});
  MlsRegistrationOptions options = EngineRegistrationOptions();
  if (noise.has_value()) {
    options.guess_sigma_m = std::max(noise->sigma_m, kLeastSigmaM);
    options.guess_sigma_rad = std::max(noise->sigma_rad, kLeastSigmaRad);
  }
  return RegisterScan(*scan.features, target, guess, options);
}

// What is near for sure may be seen through more: glass, and people on their way.
PlaceMatchOptions PlaceOptions(Nearness nearness) {
  PlaceMatchOptions options;
  options.registration = EngineRegistrationOptions();
  if (nearness == Nearness::kSamePass) {
    options.min_overlap = 0.6;
    options.max_contradiction = 0.1;
  }
  return options;
}

std::vector<SeenScan> Nearest(std::span<const SeenScan> around, const Pose& place) {
  std::vector<SeenScan> nearest(around.begin(), around.end());
  const auto distance = [&](const SeenScan& s) {
    return (s.T_target_scan.translation() - place.translation()).squaredNorm();
  };
  std::stable_sort(nearest.begin(), nearest.end(), [&](const SeenScan& a, const SeenScan& b) {
    return distance(a) < distance(b);
  });
  if (nearest.size() > kPlaceScans) nearest.resize(kPlaceScans);
  return nearest;
}

PlaceMatch PlaceOf(const SeenScan& scan,
                   std::span<const SeenScan> around,
                   const Pose& guess,
                   Nearness nearness) {
  const PlaceHypothesis window = SaidHypothesis(guess);
  return MatchPlace(scan, Nearest(around, guess), {&window, 1}, PlaceOptions(nearness));
}

// How the scan fits the nearest scans around if it was taken here: it shows what they show, and
// neither looked through what the other saw. That it fits elsewhere, too, is no reason to doubt
// what is said. Of one pass that is enough; frames may be off, so there a match that may slide says
// nothing. Nothing where it was not taken here.
std::optional<PlaceMatch> MatchHere(const SeenScan& scan,
                                    std::span<const SeenScan> around,
                                    const Pose& place,
                                    Nearness nearness) {
  const PlaceHypothesis here{place, 0.0, 0.0, 0.0};
  PlaceMatchOptions options = PlaceOptions(Nearness::kSamePass);
  const double much = std::exchange(options.min_overlap, kLittleOverlap);
  const PlaceMatch match = MatchPlace(scan, Nearest(around, place), {&here, 1}, options);
  const double most = match.overlap >= much ? options.max_contradiction : kLittleContradiction;
  const bool fits = Same(match.T_target_source, place) && match.overlap >= options.min_overlap &&
                    match.contradiction <= most;
  if (!fits || (nearness != Nearness::kSamePass && !match.matched())) return std::nullopt;
  return match;
}

// Whether a registration that agrees with the guess is believed without a look around. One that
// left directions as they were guessed agrees with any guess.
bool SpeaksForItself(const RegistrationResult& match, Nearness nearness) {
  return nearness == Nearness::kSamePass && match.termination != Termination::kDegenerate &&
         match.overlap >= kLeastAgreement;
}

bool MaySlide(const PlaceMatch& here) { return here.verdict == PlaceVerdict::kDegenerate; }

}  // namespace

Link LinkScan(const SeenScan& scan,
              std::span<const SeenScan> around,
              const Pose& guess,
              Nearness nearness,
              const std::optional<OdometryNoise>& noise) {
  const RegistrationResult match = Register(scan, around, guess, noise);
  Link link = LinkOf(match);
  const bool agrees = Accepted(match.termination) && Same(match.T_target_source, guess);
  if (agrees && SpeaksForItself(match, nearness)) return link;
  std::optional<PlaceMatch> here;
  if (agrees) here = MatchHere(scan, around, match.T_target_source, nearness);
  if (here.has_value() && !MaySlide(*here)) return link;
  const PlaceMatch place = PlaceOf(scan, around, guess, nearness);
  if (here.has_value() && here->fit >= kLeastShareOfBest * place.fit) return link;
  // Registration may leave the window: rooms that look alike are farther apart than it is wide.
  if (IsSure(place, guess, nearness) && IsWithin(place.T_target_source, SaidHypothesis(guess))) {
    const RegistrationResult found = Register(scan, around, place.T_target_source);
    if (Accepted(found.termination) && Same(found.T_target_source, place.T_target_source)) {
      return LinkOf(found);
    }
  }
  link.report.aligned = false;
  link.report.message =
      absl::StrCat(agrees                        ? "shows something else than the scans around"
                   : Accepted(match.termination) ? "too far from what the robot says"
                                                 : ToString(match.termination),
                   "; as a place: ",
                   place.matched() ? "doubtful" : ToString(place.verdict));
  link.T_map_scan = guess;
  return link;
}

Link AgreeingLink(const SeenScan& scan,
                  std::span<const SeenScan> around,
                  const Pose& known,
                  const std::optional<OdometryNoise>& noise) {
  const RegistrationResult match = Register(scan, around, known, noise);
  Link link = LinkOf(match);
  link.report.aligned = Accepted(match.termination) && match.overlap >= kLeastAgreement &&
                        Same(match.T_target_source, known);
  return link;
}

Link VerifiedLink(const SeenScan& scan, std::span<const SeenScan> around, const Pose& known) {
  Link link = AgreeingLink(scan, around, known);
  link.report.aligned =
      link.report.aligned && MatchHere(scan, around, link.T_map_scan, Nearness::kSaid).has_value();
  return link;
}

}  // namespace strata
