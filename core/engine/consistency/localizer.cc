#include "core/engine/consistency/localizer.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <Eigen/LU>

#include "core/common/status.h"
#include "core/engine/consistency/graph_world.h"
#include "core/engine/map/parallel.h"
#include "core/engine/scans/matching.h"
#include "core/engine/scans/scan_source.h"
#include "core/engine/scans/scan_views.h"
#include "core/mls/build.h"
#include "core/posegraph/information.h"
#include "core/registration/neighbours.h"
#include "core/registration/place_index.h"
#include "core/registration/place_match.h"
#include "core/registration/upright_frame.h"
#include "core/registration/upright_offsets.h"

namespace strata {
namespace {

// Places that are looked at closely.
constexpr std::size_t kMaxCandidates = 12;
// Candidates nearer to each other show the same.
constexpr double kApartM = 3.0;
// Scans around a candidate that make up the place.
constexpr NeighbourPolicy kPlace = {.radius_m = 10.0, .max_scans = 5};
// How far from a candidate the scan may have been taken, where only looks speak for it.
constexpr double kAlikeRadiusM = 15.0;
// To both sides of a guess's heading, and of the heading that looks say.
constexpr double kGuessHeadingRad = 0.6;
constexpr double kAlikeHeadingRad = 0.1;
// Errors of a match beside what its information says.
constexpr double kMatchSigmaM = 0.05;
constexpr double kMatchSigmaRad = 0.005;

// A scan of the map near which the asked one may have been taken.
struct Candidate {
  std::size_t node = 0;
  std::vector<PlaceHypothesis> hypotheses;  // in the frame of the node
};

// Damaged, or deleted since it was listed.
bool IsNoPlace(const absl::Status& status) {
  return absl::IsDataLoss(status) || absl::IsNotFound(status);
}

}  // namespace

struct Localizer::Places {
  Places(const ScanAccess& access, MapView of, GraphWorld read)
      : view(of), world(std::move(read)), views(access, world.Scans()) {}

  // What that scan looks like; nullptr: not known.
  const PlaceDescriptor* FindPlace(ScanNumber number) const {
    const std::vector<ScanRecord>& scans = world.Scans();
    const auto it = std::lower_bound(
        scans.begin(), scans.end(), number, [](const ScanRecord& scan, ScanNumber wanted) {
          return scan.number < wanted;
        });
    if (it == scans.end() || it->number != number) return nullptr;
    const PlaceDescriptor* found = index.Find(static_cast<std::uint64_t>(it - scans.begin()));
    return found == nullptr || found->empty() ? nullptr : found;
  }

  const MapView view;
  const GraphWorld world;
  ScanViews views;
  PlaceIndex index;  // by node
};

Localizer::~Localizer() = default;

// One question.
class Localizer::Search {
 public:
  Search(const ScanAccess& access, Places& places, const LocalizeQuery& query, const Stop& stop)
      : access_(access), places_(places), query_(query), stop_(stop) {}

  absl::StatusOr<LocalizeResult> Run() {
    STRATA_RETURN_IF_ERROR(Describe());
    const std::vector<Candidate> candidates =
        query_.T_map_scan_guess.has_value() ? NearGuess() : Alike();
    std::vector<PlaceMatch> matches(candidates.size());
    STRATA_RETURN_IF_ERROR(
        ParallelFor(access_.threads(), candidates.size(), [&](int, std::size_t k) -> absl::Status {
          STRATA_RETURN_IF_ERROR(stop_.status());
          STRATA_ASSIGN_OR_RETURN(matches[k], Try(candidates[k]));
          return absl::OkStatus();
        }));
    return Answer(candidates, matches);
  }

 private:
  absl::Status Describe() {
    ScanRecord scan;
    scan.header.sensor_origin = query_.cloud.sensor_origin;
    // Without a guess nobody knows how a sensor is held.
    scan.header.T_map_scan = query_.T_map_scan_guess.value_or(Pose::Identity());
    ScanFeatureOptions options = FeatureOptionsOf(scan);
    options.up = BelievedUp(query_.cloud.points, options.up);
    options.R_map_scan = UprightTurn(options.up);
    MlsParameters parameters = access_.parameters().mls;
    STRATA_ASSIGN_OR_RETURN(const MlsMap seen, Seen(parameters, options.R_map_scan));
    place_ = DescribePlace(seen);
    parameters.cell_size_m = std::min(parameters.cell_size_m, kRegistrationCellM);
    STRATA_ASSIGN_OR_RETURN(const MlsMap finer, Seen(parameters, options.R_map_scan));
    UprightOffsets offsets(finer, options.samples_per_metre, options.R_map_scan);
    offsets.Add(query_.cloud.points);
    features_ = ScanFeatures::FromMap(finer, options, &offsets);
    return absl::OkStatus();
  }

  absl::StatusOr<MlsMap> Seen(const MlsParameters& parameters,
                              const Eigen::Matrix3d& R_upright_scan) const {
    MlsScratch scratch;
    STRATA_ASSIGN_OR_RETURN(MlsBuildResult built,
                            BuildMlsMap(query_.cloud,
                                        Pose(R_upright_scan),
                                        query_.sensor.value_or(access_.parameters().sensor),
                                        parameters,
                                        scratch));
    return std::move(built.map);
  }

  // The scans around the guess, nearest first, not all of the same place.
  std::vector<Candidate> NearGuess() const {
    const Pose& guess = *query_.T_map_scan_guess;
    std::vector<std::pair<double, std::size_t>> near;
    for (std::size_t k = 0; k < places_.world.size(); ++k) {
      const double distance = (places_.world.Poses()[k].translation() - guess.translation()).norm();
      if (distance <= query_.guess_radius_m + kPlace.radius_m) near.push_back({distance, k});
    }
    std::sort(near.begin(), near.end());
    std::vector<Candidate> candidates;
    for (const auto& [distance, node] : near) {
      if (candidates.size() == kMaxCandidates) break;
      if (ShowsTheSame(candidates, node)) continue;
      const double window = std::min(query_.guess_radius_m, 2.0 * kAlikeRadiusM);
      candidates.push_back(
          {node,
           {{places_.world.Poses()[node].inverse() * guess, window, window, kGuessHeadingRad}}});
    }
    return candidates;
  }

  std::vector<Candidate> Alike() const {
    std::vector<Candidate> candidates;
    const auto none = [](std::uint64_t) { return false; };
    for (const PlaceIndex::Neighbour& alike :
         places_.index.Nearest(place_, 4 * kMaxCandidates, none)) {
      if (candidates.size() == kMaxCandidates) break;
      const auto node = static_cast<std::size_t>(alike.number);
      if (ShowsTheSame(candidates, node)) continue;
      Candidate candidate{node, {}};
      const Eigen::Matrix3d R_upright_node = UprightTurn(UpOf(places_.world.Poses()[node]));
      for (PlaceHypothesis hypothesis :
           HypothesesOf(alike.similarity, R_upright_node, UprightTurn(features_.up()))) {
        hypothesis.radius_m = kAlikeRadiusM;
        hypothesis.height_range_m = kPlace.radius_m;
        hypothesis.heading_range_rad = kAlikeHeadingRad;
        candidate.hypotheses.push_back(hypothesis);
      }
      candidates.push_back(std::move(candidate));
    }
    return candidates;
  }

  bool ShowsTheSame(const std::vector<Candidate>& candidates, std::size_t node) const {
    return std::any_of(candidates.begin(), candidates.end(), [&](const Candidate& other) {
      return (places_.world.Poses()[other.node].translation() -
              places_.world.Poses()[node].translation())
                 .norm() < kApartM;
    });
  }

  // In the map frame.
  absl::StatusOr<PlaceMatch> Try(const Candidate& candidate) {
    const std::vector<Pose>& poses = places_.world.Poses();
    const Pose T_place_map = poses[candidate.node].inverse();
    std::vector<std::shared_ptr<const ScanFeatures>> held;
    std::vector<SeenScan> target;
    for (const std::size_t k : SelectNeighbours(poses, poses[candidate.node], kPlace)) {
      absl::StatusOr<std::shared_ptr<const ScanFeatures>> features = places_.views.Features(k);
      if (IsNoPlace(features.status())) continue;
      STRATA_RETURN_IF_ERROR(features.status());
      held.push_back(*std::move(features));
      target.push_back({held.back().get(),
                        T_place_map * poses[k],
                        places_.views.scan(k).header.sensor_origin.cast<double>()});
    }
    if (target.empty()) return PlaceMatch();
    PlaceMatch match =
        MatchPlace({&features_, Pose::Identity(), query_.cloud.sensor_origin.cast<double>()},
                   target,
                   candidate.hypotheses,
                   Options());
    match.T_target_source = Normalized(poses[candidate.node] * match.T_target_source);
    return match;
  }

  static PlaceMatchOptions Options() {
    PlaceMatchOptions options;
    options.registration = EngineRegistrationOptions();
    return options;
  }

  LocalizeResult Answer(const std::vector<Candidate>& candidates,
                        const std::vector<PlaceMatch>& matches) const {
    LocalizeResult result;
    result.epoch = places_.world.epoch();
    const std::optional<std::size_t> best = UniquePlace(matches, Options());
    if (best.has_value()) {
      const PlaceMatch& match = matches[*best];
      result.found = true;
      result.best = CandidateOf(candidates[*best], match);
      result.covariance =
          LoosenedInformation(match.information, IsotropicInformation(kMatchSigmaRad, kMatchSigmaM))
              .inverse();
      result.message = absl::StrFormat("taken at %s: %.0f %% of what it shows is there",
                                       result.best.place.ToString(),
                                       100.0 * match.overlap);
    } else {
      result.message = WhyNot(matches);
    }
    AddOthers(candidates, matches, best, result);
    return result;
  }

  LocalizeCandidate CandidateOf(const Candidate& candidate, const PlaceMatch& match) const {
    return {match.T_target_source,
            places_.world.id(candidate.node),
            match.overlap,
            match.rms_m,
            match.confidence};
  }

  std::string WhyNot(const std::vector<PlaceMatch>& matches) const {
    if (matches.empty()) {
      return query_.T_map_scan_guess.has_value() ? "no scan of the map is near the guess"
                                                 : "no scan of the map looks alike";
    }
    const auto closest = std::max_element(
        matches.begin(), matches.end(), [](const PlaceMatch& a, const PlaceMatch& b) {
          return a.overlap < b.overlap;
        });
    const bool several = std::count_if(matches.begin(), matches.end(), [](const PlaceMatch& match) {
                           return match.matched();
                         }) > 1;
    if (several) return "several places fit as well as each other; a guess would tell them apart";
    return absl::StrFormat("none of %d places fits; the closest: %s, overlap %.2f",
                           matches.size(),
                           ToString(closest->verdict),
                           closest->overlap);
  }

  void AddOthers(const std::vector<Candidate>& candidates,
                 const std::vector<PlaceMatch>& matches,
                 const std::optional<std::size_t>& best,
                 LocalizeResult& result) const {
    std::vector<LocalizeCandidate> others;
    for (std::size_t k = 0; k < matches.size(); ++k) {
      if (!matches[k].matched() || (best.has_value() && k == *best)) continue;
      others.push_back(CandidateOf(candidates[k], matches[k]));
    }
    std::stable_sort(others.begin(), others.end(), [](const auto& a, const auto& b) {
      return a.confidence > b.confidence;
    });
    for (const LocalizeCandidate& other : others) {
      const auto same = [&other](const LocalizeCandidate& known) {
        return (known.T_map_scan.translation() - other.T_map_scan.translation()).norm() < 1.0;
      };
      if (result.found && same(result.best)) continue;
      if (std::any_of(result.others.begin(), result.others.end(), same)) continue;
      result.others.push_back(other);
    }
  }

  const ScanAccess& access_;
  Places& places_;
  const LocalizeQuery& query_;
  const Stop& stop_;
  PlaceDescriptor place_;
  ScanFeatures features_;
};

// What a scan looks like is of its points, and stays when the map changes.
absl::StatusOr<std::vector<PlaceDescriptor>> Localizer::Describe(Places& places,
                                                                 const Places* before,
                                                                 const Stop& stop) const {
  std::vector<PlaceDescriptor> descriptors(places.world.size());
  STRATA_RETURN_IF_ERROR(
      ParallelFor(access_.threads(), descriptors.size(), [&](int, std::size_t k) -> absl::Status {
        STRATA_RETURN_IF_ERROR(stop.status());
        const PlaceDescriptor* const known =
            before != nullptr ? before->FindPlace(places.world.number(k)) : nullptr;
        if (known != nullptr) {
          descriptors[k] = *known;
          return absl::OkStatus();
        }
        absl::StatusOr<PlaceDescriptor> place = places.views.Place(k);
        if (IsNoPlace(place.status())) return absl::OkStatus();
        STRATA_RETURN_IF_ERROR(place.status());
        descriptors[k] = *std::move(place);
        return absl::OkStatus();
      }));
  return descriptors;
}

absl::StatusOr<std::shared_ptr<Localizer::Places>> Localizer::CurrentPlaces(const Stop& stop) {
  STRATA_ASSIGN_OR_RETURN(const MapView view, access_.View());
  std::shared_ptr<Places> before;
  {
    absl::MutexLock lock(&mutex_);
    if (places_ != nullptr && places_->view == view) return places_;
    before = places_;
  }
  std::shared_ptr<Places> places;
  {
    STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, access_.Reader());
    STRATA_ASSIGN_OR_RETURN(GraphWorld world, GraphWorld::Read(*reader));
    places = std::make_shared<Places>(access_, view, std::move(world));
  }
  STRATA_ASSIGN_OR_RETURN(const std::vector<PlaceDescriptor> descriptors,
                          Describe(*places, before.get(), stop));
  for (std::size_t k = 0; k < descriptors.size(); ++k) places->index.Add(k, descriptors[k]);
  absl::MutexLock lock(&mutex_);
  places_ = places;
  return places;
}

absl::StatusOr<LocalizeResult> Localizer::Localize(const LocalizeQuery& query, const Stop& stop) {
  STRATA_RETURN_IF_ERROR(ValidateLocalizeQuery(query));
  STRATA_ASSIGN_OR_RETURN(const std::shared_ptr<Places> places, CurrentPlaces(stop));
  return Search(access_, *places, query, stop).Run();
}

}  // namespace strata
