#include "core/engine/plans/seen_spaces.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/cleanup/cleanup.h"
#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include <Eigen/Core>

#include "core/cloud/point_cloud.h"
#include "core/cloud/sensor_model.h"
#include "core/common/blocking.h"
#include "core/common/status.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/scans/scan_share.h"
#include "core/engine/scans/scan_source.h"
#include "core/occupancy/occupancy_voxels.h"
#include "core/storage/storage.h"
#include "core/world/map_info.h"

namespace strata {
namespace {

constexpr absl::Duration kStopPoll = absl::Milliseconds(50);

// Around all rays of a scan, in the map.
Eigen::AlignedBox3d HullOf(const PosedScan& posed) {
  Eigen::AlignedBox3d hull;
  const auto add = [&](const Eigen::Vector3f& p) {
    hull.extend(posed.pose->T_map_scan * p.cast<double>());
  };
  add(posed.scan.header.sensor_origin);
  if (posed.scan.box_scan.isEmpty()) return hull;
  for (int i = 0; i < 8; ++i) {
    add(posed.scan.box_scan.corner(static_cast<Eigen::AlignedBox3f::CornerType>(i)));
  }
  return hull;
}

// The points that cast rays; the others are made to be none.
PointCloud RaysOf(const PointCloud& block, const std::vector<std::uint16_t>& faded) {
  PointCloud rays;
  rays.sensor_origin = block.sensor_origin;
  rays.points = block.points;
  for (std::size_t i = 0; i < faded.size() && i < rays.points.size(); ++i) {
    if (faded[i] != 0) rays.points[i].setConstant(std::numeric_limits<float>::quiet_NaN());
  }
  return rays;
}

}  // namespace

SeenSpaces::SeenSpaces(std::string name,
                       const MapParameters& parameters,
                       const std::shared_ptr<CacheBudget>& caches)
    : name_(std::move(name)),
      parameters_(parameters),
      caches_(caches),
      known_(caches, caches->max_bytes() / 4) {}

absl::StatusOr<std::shared_ptr<const SeenSpace>> SeenSpaces::Find(MapState& state,
                                                                  const Eigen::AlignedBox3d& region,
                                                                  double voxel_m,
                                                                  const Stop& stop) {
  const Eigen::Vector3d low = region.min();
  const Eigen::Vector3d high = region.max();
  const Key key = {low.x(), low.y(), low.z(), high.x(), high.y(), high.z(), voxel_m};
  const std::uint64_t now = state.changes().last;
  if (const auto known = known_.Find(key); known != nullptr && known->commit_sequence == now) {
    return known->space;
  }
  STRATA_RETURN_IF_ERROR(AwaitTurn(stop));
  const absl::Cleanup done = [this] {
    const absl::MutexLock lock(&mutex_);
    making_ = false;
  };
  const auto known = known_.Find(key);
  if (known != nullptr && known->commit_sequence == now) return known->space;  // made meanwhile
  STRATA_ASSIGN_OR_RETURN(auto made, Make(state, region, voxel_m, known.get(), stop));
  known_.Put(key, made, made->space->voxels.bytes() + made->casts.capacity() * sizeof(Cast));
  return made->space;
}

absl::Status SeenSpaces::AwaitTurn(const Stop& stop) {
  const BlockingScope blocking;
  const absl::MutexLock lock(&mutex_);
  const auto is_free = [this]() ABSL_SHARED_LOCKS_REQUIRED(mutex_) { return !making_; };
  while (!mutex_.AwaitWithTimeout(absl::Condition(&is_free), kStopPoll)) {
    STRATA_RETURN_IF_ERROR(stop.status());
  }
  making_ = true;
  return absl::OkStatus();
}

bool SeenSpaces::Cast::Is(const PosedScan& posed) const {
  return number == posed.scan.number && faded_points == posed.scan.faded_points && !left_out &&
         T_map_scan.matrix() == posed.pose->T_map_scan.matrix();
}

absl::StatusOr<SeenSpace> SeenSpaces::Begin(const Eigen::AlignedBox3d& region,
                                            double voxel_m) const {
  OccupancyVoxelsOptions options;
  options.voxel_m = voxel_m;
  options.region = region;
  options.model = InverseSensorModel::OfOneLook();
  options.farthest_voxel = kMostNodes;  // maps may lie where UTM has them
  STRATA_RETURN_IF_ERROR(options.Validate());
  return SeenSpace{OccupancyVoxels(options)};
}

absl::Status SeenSpaces::Add(ScanSource& source,
                             const PosedScan& posed,
                             const Stop& stop,
                             std::vector<Cast>& casts,
                             SeenSpace& seen) const {
  const SensorModel sensor = posed.scan.header.sensor.value_or(parameters_.sensor);
  const Pose& T_map_scan = posed.pose->T_map_scan;
  const ScanShare share(caches_, posed.scan);
  const absl::Status added =
      source.ForEachBlock(posed.scan, [&](const PointCloud& block) -> absl::Status {
        return seen.voxels.Add(RaysOf(block, source.faded()), T_map_scan, sensor, stop);
      });
  const bool left_out = absl::IsDataLoss(added) || absl::IsNotFound(added);
  if (!left_out) STRATA_RETURN_IF_ERROR(added);
  casts.push_back({posed.scan.number, posed.scan.faded_points, T_map_scan, left_out});
  if (!left_out) {
    seen.looks.push_back(
        T_map_scan * Pose(Eigen::Translation3d(posed.scan.header.sensor_origin.cast<double>())));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<const SeenSpaces::Known>> SeenSpaces::Make(
    MapState& state,
    const Eigen::AlignedBox3d& region,
    double voxel_m,
    const Known* before,
    const Stop& stop) {
  std::vector<PosedScan> scans;
  std::uint64_t without_points = 0;
  STRATA_ASSIGN_OR_RETURN(const MapState::Loan reader, state.Reader());
  ScanQuery query;
  query.state = ScanState::kIntegrated;
  query.skip_damaged = true;  // verify names it
  STRATA_RETURN_IF_ERROR(ForEachPosedScan(*reader, query, state.view().epoch, [&](PosedScan posed) {
    if (!HullOf(posed).intersects(region)) return;
    if (posed.scan.has_points) {
      scans.push_back(std::move(posed));
    } else {
      ++without_points;
    }
  }));
  auto made = std::make_shared<Known>();
  made->commit_sequence = state.changes().last;
  std::optional<SeenSpace> seen;
  if (before != nullptr && before->casts.size() <= scans.size() &&
      std::equal(before->casts.begin(),
                 before->casts.end(),
                 scans.begin(),
                 [](const Cast& cast, const PosedScan& posed) { return cast.Is(posed); })) {
    made->casts = before->casts;
    seen.emplace(*before->space);
  } else {
    STRATA_ASSIGN_OR_RETURN(seen, Begin(region, voxel_m));
  }
  ScanSource source(*reader, parameters_);
  for (std::size_t i = made->casts.size(); i < scans.size(); ++i) {
    STRATA_RETURN_IF_ERROR(Add(source, scans[i], stop, made->casts, *seen));
  }
  seen->left_out = without_points + scans.size() - seen->looks.size();
  if (seen->looks.empty() && seen->left_out > 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "map ",
        name_,
        ": the points of all ",
        seen->left_out,
        " scans around were dropped or are damaged, and without them nothing says what space was "
        "seen; explore needs a map that keeps points (map create without --drop-points)"));
  }
  made->space = std::make_shared<const SeenSpace>(*std::move(seen));
  return std::shared_ptr<const Known>(std::move(made));
}

}  // namespace strata
