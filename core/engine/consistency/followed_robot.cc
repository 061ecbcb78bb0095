#include "core/engine/consistency/followed_robot.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"

#include "core/codec/surface_tile_codec.h"
#include "core/common/status.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/scans/matching.h"
#include "core/engine/scans/scan_source.h"
#include "core/engine/tiles/epoch_tiles.h"
#include "core/registration/mls_registration.h"
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

// Finest tiles whose cells are about as wide as those that scans are matched with: of finer maps an
// overview.
std::int32_t LevelOf(double cell_size_m) {
  std::int32_t level = 0;
  while (level < kMaxLevel && std::ldexp(cell_size_m, level + 1) <= kRegistrationCellM) ++level;
  return level;
}

TileRange RangeAround(const Eigen::Vector3d& centre, double cell_size_m, std::int32_t level) {
  const double tile_m = kTileCells * std::ldexp(cell_size_m, level);
  const double radius_m = kTrackedRangeM + kSurfacesSlackM;
  const auto tile_of = [&](double at_m) {
    return static_cast<std::int64_t>(std::floor(std::clamp(at_m / tile_m, -1e9, 1e9)));
  };
  return {level,
          tile_of(centre.x() - radius_m),
          tile_of(centre.x() + radius_m) + 1,
          tile_of(centre.y() - radius_m),
          tile_of(centre.y() + radius_m) + 1};
}

// From the centre of the tile [tiles²].
double SquaredDistance(const TileKey& key, const Eigen::Vector3d& centre, double cell_size_m) {
  const double tile_m = kTileCells * std::ldexp(cell_size_m, key.level);
  const Eigen::Vector2d tile(key.x + 0.5, key.y + 0.5);
  return (tile - centre.head<2>() / tile_m).squaredNorm();
}

}  // namespace

// As a tracker asks it, during one step.
class FollowedRobot::MapNow final : public TrackedMap {
 public:
  MapNow(FollowedRobot& robot, const PointCloud& cloud, const MapView& view, const Stop& stop)
      : robot_(robot), cloud_(cloud), view_(view), stop_(stop) {}

  absl::StatusOr<std::shared_ptr<const MapSurfaces>> Around(const Eigen::Vector3d& p_map) override {
    return robot_.Around(p_map, view_, stop_);
  }

  absl::StatusOr<LocalizeResult> Find(const std::optional<Pose>& guess, double radius_m) override {
    LocalizeQuery query;
    query.cloud = cloud_;
    query.sensor = robot_.start_.sensor;
    query.T_map_scan_guess = guess;
    query.guess_radius_m = radius_m;
    STRATA_ASSIGN_OR_RETURN(LocalizeResult result, robot_.localizer_.Localize(query, stop_));
    if (result.found && result.epoch != view_.epoch) {
      result.found = false;
      result.message = "the map has just begun another epoch";
    }
    return result;
  }

 private:
  FollowedRobot& robot_;
  const PointCloud& cloud_;
  const MapView& view_;
  const Stop& stop_;
};

FollowedRobot::FollowedRobot(MapCore& core,
                             ServedTiles& tiles,
                             Localizer& localizer,
                             const TrackStart& start)
    : core_(core),
      tiles_(tiles),
      localizer_(localizer),
      start_(start),
      tracker_(start, RegistrationOptions()) {}

absl::StatusOr<ScanFeatures> FollowedRobot::FeaturesOf(const PointCloud& cloud) {
  if (CountFinite(cloud) == 0) return ScanFeatures();
  MlsParameters parameters = core_.info().parameters.mls;
  parameters.cell_size_m = std::min(parameters.cell_size_m, kRegistrationCellM);
  STRATA_ASSIGN_OR_RETURN(const MlsBuildResult built,
                          BuildMlsMap(cloud,
                                      Pose::Identity(),
                                      start_.sensor.value_or(core_.info().parameters.sensor),
                                      parameters,
                                      scratch_));
  ScanRecord scan;
  scan.header.sensor_origin = cloud.sensor_origin;
  ScanFeatureOptions options = FeatureOptionsOf(scan);
  options.max_range_m = kTrackedRangeM;
  options.sample_count = kSamples;
  return ScanFeatures::FromMap(built.map, options);
}

absl::Status FollowedRobot::Carry(std::uint64_t epoch) {
  const std::uint64_t before = std::exchange(epoch_, epoch);
  const std::optional<Pose> pose = tracker_.pose();
  if (before == 0 || before == epoch || !pose.has_value()) return absl::OkStatus();
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
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

absl::StatusOr<std::shared_ptr<const MapSurfaces>> FollowedRobot::Around(
    const Eigen::Vector3d& p_map, const MapView& view, const Stop& stop) {
  if (surfaces_ != nullptr && surfaces_view_.epoch == view.epoch &&
      (p_map - surfaces_->centre).head<2>().norm() <= kSurfacesSlackM &&
      (surfaces_view_ == view || looks_ < kLooksAtChanging)) {
    ++looks_;
    return surfaces_;
  }
  STRATA_ASSIGN_OR_RETURN(MapSurfaces surfaces, Collect(p_map, view, stop));
  surfaces_ = std::make_shared<const MapSurfaces>(std::move(surfaces));
  surfaces_view_ = view;
  looks_ = 1;
  return surfaces_;
}

absl::StatusOr<MapSurfaces> FollowedRobot::Collect(const Eigen::Vector3d& centre,
                                                   const MapView& view,
                                                   const Stop& stop) {
  const double cell_size_m = core_.info().parameters.mls.cell_size_m;
  std::vector<SurfaceTileRow> rows;
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    STRATA_ASSIGN_OR_RETURN(
        rows,
        reader->ListSurfaceTiles(RangeAround(centre, cell_size_m, LevelOf(cell_size_m)),
                                 view.tile_version));
  }
  std::stable_sort(rows.begin(), rows.end(), [&](const SurfaceTileRow& a, const SurfaceTileRow& b) {
    return SquaredDistance(a.key, centre, cell_size_m) <
           SquaredDistance(b.key, centre, cell_size_m);
  });
  MapSurfacesCollector collector(centre, cell_size_m);
  for (const SurfaceTileRow& row : rows) {
    STRATA_RETURN_IF_ERROR(stop.status());
    const absl::StatusOr<ServedTiles::Handle> served = tiles_.Find(row.key, view);
    if (absl::IsDataLoss(served.status())) continue;
    STRATA_RETURN_IF_ERROR(served.status());
    if (*served == nullptr) continue;
    const absl::StatusOr<SurfaceTile> tile = DecodeSurfaceTile((*served)->bytes);
    if (absl::IsDataLoss(tile.status())) continue;
    STRATA_RETURN_IF_ERROR(tile.status());
    if (!collector.Add(*tile)) break;
  }
  return std::move(collector).Finish();
}

absl::StatusOr<TrackedPose> FollowedRobot::Step(const TrackStep& step, const Stop& stop) {
  STRATA_RETURN_IF_ERROR(ValidateTrackStep(step));
  const Snapshots::Pin pin = core_.snapshots().PinCurrent();
  STRATA_RETURN_IF_ERROR(Carry(pin.view().epoch));
  STRATA_ASSIGN_OR_RETURN(const ScanFeatures features, FeaturesOf(step.cloud));
  MapNow map(*this, step.cloud, pin.view(), stop);
  STRATA_ASSIGN_OR_RETURN(TrackedPose pose, tracker_.Step(step, features, map));
  pose.epoch = pin.view().epoch;
  return pose;
}

}  // namespace strata
