#include "core/engine/consistency/followed_robot.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"

#include "core/common/status.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/scans/matching.h"
#include "core/engine/scans/scan_source.h"
#include "core/engine/tiles/epoch_tiles.h"
#include "core/registration/mls_registration.h"
#include "core/registration/upright_frame.h"
#include "core/registration/upright_offsets.h"
#include "core/storage/storage.h"

namespace strata {
namespace {

// Looks at surfaces of which some have changed since, without an epoch of its own.
constexpr int kLooksAtChanging = 10;

// Half of what scans are aligned with: no chain of hundreds hangs on one match.
constexpr int kSamples = 2000;

MlsRegistrationOptions RegistrationOptions() {
  MlsRegistrationOptions options = EngineRegistrationOptions();
  options.max_samples = kSamples;
  return options;
}

}  // namespace

// As a tracker asks it, during one step.
class FollowedRobot::MapNow final : public TrackedMap {
 public:
  MapNow(FollowedRobot& robot,
         const PointCloud& cloud,
         const FollowedRobot::Around& around,
         const Stop& stop)
      : robot_(robot), cloud_(cloud), around_(around), stop_(stop) {}

  absl::StatusOr<std::shared_ptr<const MapSurfaces>> Around(const Eigen::Vector3d& p_map) override {
    return robot_.Look(p_map, around_, stop_);
  }

  absl::StatusOr<LocalizeResult> Find(const std::optional<Pose>& guess, double radius_m) override {
    LocalizeQuery query;
    query.cloud = cloud_;
    query.sensor = robot_.start_.sensor;
    query.T_map_scan_guess = guess;
    query.guess_radius_m = radius_m;
    STRATA_ASSIGN_OR_RETURN(LocalizeResult result, around_.localizer.Localize(query, stop_));
    if (result.found && result.epoch != around_.state.view().epoch) {
      result.found = false;
      result.message = "the map has just begun another epoch";
    }
    return result;
  }

 private:
  FollowedRobot& robot_;
  const PointCloud& cloud_;
  const FollowedRobot::Around& around_;
  const Stop& stop_;
};

FollowedRobot::FollowedRobot(const TrackStart& start)
    : start_(start), tracker_(start, RegistrationOptions()) {}

absl::StatusOr<ScanFeatures> FollowedRobot::FeaturesOf(const PointCloud& cloud,
                                                       const MapParameters& map) {
  if (CountFinite(cloud) == 0) return ScanFeatures();
  ScanRecord scan;
  scan.header.sensor_origin = cloud.sensor_origin;
  if (tracker_.pose().has_value()) scan.header.T_map_scan = *tracker_.pose();
  ScanFeatureOptions options = FeatureOptionsOf(scan);
  options.max_range_m = kTrackedRangeM;
  options.sample_count = kSamples;
  options.up = BelievedUp(cloud.points, options.up);
  options.R_map_scan = UprightTurn(options.up);
  MlsParameters parameters = map.mls;
  parameters.cell_size_m = std::min(parameters.cell_size_m, kRegistrationCellM);
  STRATA_ASSIGN_OR_RETURN(const MlsBuildResult built,
                          BuildMlsMap(cloud,
                                      Pose(options.R_map_scan),
                                      start_.sensor.value_or(map.sensor),
                                      parameters,
                                      scratch_));
  UprightOffsets offsets(built.map, options.samples_per_metre, options.R_map_scan);
  offsets.Add(cloud.points);
  return ScanFeatures::FromMap(built.map, options, &offsets);
}

absl::Status FollowedRobot::Carry(const MapState& state) {
  const std::uint64_t epoch = state.view().epoch;
  const std::uint64_t before = std::exchange(epoch_, epoch);
  const std::optional<Pose> pose = tracker_.pose();
  if (before == 0 || before == epoch || !pose.has_value()) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state.Reader());
  std::optional<PosedScan> nearest;
  double nearest_m = std::numeric_limits<double>::infinity();
  const auto look = [&](PosedScan scan) {
    const double apart_m = (scan.pose->T_map_scan.translation() - pose->translation()).norm();
    if (apart_m >= nearest_m) return;
    nearest_m = apart_m;
    nearest = std::move(scan);
  };
  // Where its poses are not kept any more the next scan tells.
  const absl::Status kept = CheckEpochKept(*reader, before);
  if (absl::IsNotFound(kept)) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(kept);
  STRATA_RETURN_IF_ERROR(ForEachPosedScan(*reader, ScanQuery(), before, look));
  if (!nearest.has_value()) return absl::OkStatus();
  const absl::StatusOr<PosedScan> now = reader->GetScan(nearest->scan.number, epoch);
  if (absl::IsNotFound(now.status())) return absl::OkStatus();
  STRATA_RETURN_IF_ERROR(now.status());
  if (!now->pose.has_value()) return absl::OkStatus();
  tracker_.Move(now->pose->T_map_scan * nearest->pose->T_map_scan.inverse());
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<const MapSurfaces>> FollowedRobot::Look(const Eigen::Vector3d& p_map,
                                                                       const Around& around,
                                                                       const Stop& stop) {
  const MapView& view = around.state.view();
  const bool stays = looks_ > 0 && seen_view_.epoch == view.epoch &&
                     (p_map - CentreOf(seen_)).head<2>().norm() <= kSurfacesSlackM &&
                     (seen_view_ == view || looks_ < kLooksAtChanging);
  if (!stays) {
    seen_ = NearestPlace(p_map);
    seen_view_ = view;
    looks_ = 0;
  }
  ++looks_;
  // Of an older view of this epoch it may be gone: then as the map is now.
  if (seen_view_ != view) {
    if (auto held = around.surfaces.FindAtHand(seen_, seen_view_); held != nullptr) return held;
    seen_view_ = view;
    looks_ = 1;
  }
  return around.surfaces.Find(seen_, around.state, stop);
}

absl::StatusOr<TrackedPose> FollowedRobot::Step(const TrackStep& step,
                                                const Around& around,
                                                const Stop& stop) {
  STRATA_RETURN_IF_ERROR(ValidateTrackStep(step));
  STRATA_RETURN_IF_ERROR(Carry(around.state));
  STRATA_ASSIGN_OR_RETURN(const ScanFeatures features, FeaturesOf(step.cloud, around.parameters));
  MapNow map(*this, step.cloud, around, stop);
  STRATA_ASSIGN_OR_RETURN(TrackedPose pose, tracker_.Step(step, features, map));
  pose.epoch = around.state.view().epoch;
  return pose;
}

}  // namespace strata
