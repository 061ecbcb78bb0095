#include "core/engine/objects/thing_views.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/container/btree_map.h"
#include "absl/status/status.h"

#include "core/common/status.h"
#include "core/completion/beams_by_azimuth.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/scans/scan_share.h"
#include "core/engine/scans/scan_source.h"
#include "core/geometry/pose.h"

namespace strata {
namespace {

using Eigen::Vector3d;

// Around what was measured: what else of a thing may be there.
constexpr double kMarginM = 0.2;
constexpr double kLeastMarginM = 0.025;  // of a thing's own points around its box
// Pieces of one thing say so differently where it stands at most, also as a share of its length:
// two things are farther apart.
constexpr double kMostApartM = 0.2;
constexpr double kMostApartShare = 0.25;

// Whether what both say about where their kind stands is the same at both of them.
bool StandInOnePlace(const Entity& a, const Entity& b, double length_m) {
  if ((a.box.centre - b.box.centre).norm() > 2.0 * length_m) return false;
  const Pose T_kind_a = a.kind->T_map_kind.inverse();
  const Pose T_b_a = b.kind->T_map_kind * T_kind_a;
  const double most_m = std::min(kMostApartM, kMostApartShare * length_m);
  return (T_b_a * a.box.centre - a.box.centre).norm() <= most_m &&
         (T_b_a * b.box.centre - b.box.centre).norm() <= most_m;
}

// Counts the piece's points and scans as the thing's.
void AddPiece(const Entity& piece, WholeThing& thing) {
  thing.boxes.push_back(piece.box);
  thing.entity.points += piece.points;
  for (const EntityScan& seen : piece.scans) {
    std::vector<EntityScan>& scans = thing.entity.scans;
    const auto same = std::find_if(
        scans.begin(), scans.end(), [&](const EntityScan& s) { return s.scan == seen.scan; });
    if (same == scans.end()) {
      scans.push_back(seen);
    } else {
      same->points += seen.points;
    }
  }
}

// The scans that saw most of each thing, with which things those are.
absl::btree_map<ScanId, std::vector<std::size_t>> ScansOf(std::span<const WholeThing> things) {
  absl::btree_map<ScanId, std::vector<std::size_t>> scans;
  for (std::size_t i = 0; i < things.size(); ++i) {
    std::vector<EntityScan> seen = things[i].entity.scans;
    std::stable_sort(seen.begin(), seen.end(), [](const EntityScan& a, const EntityScan& b) {
      return a.points > b.points;
    });
    seen.resize(std::min(seen.size(), kMostScansOfThing));
    for (const EntityScan& scan : seen) scans[scan.scan].push_back(i);
  }
  return scans;
}

// Whether a point of the map is in the box, or so near to it.
bool IsInBox(const UprightBox& box, const Vector3d& p, double margin_m) {
  const Vector3d from = Eigen::AngleAxisd(-box.yaw_rad, Vector3d::UnitZ()) * (p - box.centre);
  return (from.cwiseAbs().array() <= box.size.array() / 2.0 + margin_m).all();
}

absl::StatusOr<PosedScan> FindScan(MapCore& core, const ScanId& id, std::uint64_t epoch) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  return GetScanById(*reader, id, epoch);
}

// Adds scans to the views of the things that they saw.
class ViewReader {
 public:
  ViewReader(MapCore& core, std::span<const WholeThing> things, ThingViews& out)
      : core_(core), things_(things), out_(out) {}

  absl::Status Add(const PosedScan& posed, const std::vector<std::size_t>& seen, const Stop& stop) {
    const MapParameters parameters = core_.info().parameters;
    const SensorModel sensor = posed.scan.header.sensor.value_or(parameters.sensor);
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_.Reader());
    const ScanShare share(core_.caches(), posed.scan);
    ScanSource source(*reader, parameters);
    return source.ForEachBlock(posed.scan, [&](const PointCloud& block) -> absl::Status {
      PointCloud lasting;
      if (!source.faded().empty()) {
        lasting = PointsOf(block, [&](std::size_t i) { return source.faded()[i] == 0; });
      }
      const PointCloud& cloud = source.faded().empty() ? block : lasting;
      const BeamsByAzimuth beams(cloud, posed.pose->T_map_scan);
      for (const std::size_t i : seen) {
        const PointCloud part =
            beams.Towards(out_.views[i].box(), things_[i].entity.kind->T_map_kind);
        STRATA_RETURN_IF_ERROR(AddTo(i, part, posed.pose->T_map_scan, sensor, stop));
      }
      return absl::OkStatus();
    });
  }

 private:
  absl::Status AddTo(std::size_t i,
                     const PointCloud& cloud,
                     const Pose& T_map_scan,
                     const SensorModel& sensor,
                     const Stop& stop) {
    const Entity& thing = things_[i].entity;
    const std::vector<UprightBox>& boxes = things_[i].boxes;
    ShapeView& view = out_.views[i];
    const Pose T_kind_map = thing.kind->T_map_kind.inverse();
    const double margin_m = std::max(kLeastMarginM, view.voxel_m());
    std::vector<Vector3d> points;
    for (std::size_t k = 0; k < cloud.label.size(); ++k) {
      if (cloud.label[k] != thing.class_id) continue;
      const Vector3d p = T_map_scan * (cloud.points[k].cast<double>() + cloud.origin);
      if (std::any_of(boxes.begin(), boxes.end(), [&](const UprightBox& box) {
            return IsInBox(box, p, margin_m);
          })) {
        points.push_back(T_kind_map * p);
      }
    }
    view.AddPoints(points);
    return view.AddScan(cloud, T_kind_map * T_map_scan, sensor, stop);
  }

  MapCore& core_;
  const std::span<const WholeThing> things_;
  ThingViews& out_;
};

}  // namespace

std::vector<WholeThing> WholeThingsOf(std::span<const Entity> entities) {
  double length_m = 0.0;
  for (const Entity& entity : entities) {
    length_m = std::max(length_m, entity.box.size.maxCoeff());
  }
  std::vector<WholeThing> things;
  for (const Entity& entity : entities) {
    const auto whole = std::find_if(things.begin(), things.end(), [&](const WholeThing& thing) {
      return StandInOnePlace(thing.entity, entity, length_m);
    });
    if (whole == things.end()) {
      things.push_back({entity, {entity.box}});
    } else {
      AddPiece(entity, *whole);
    }
  }
  return things;
}

Eigen::AlignedBox3d BoxOfKind(std::span<const WholeThing> things) {
  Eigen::AlignedBox3d bounds;
  for (const WholeThing& thing : things) {
    const Pose T_kind_map = thing.entity.kind->T_map_kind.inverse();
    for (const UprightBox& box : thing.boxes) {
      const double half_height_m = box.size.z() / 2.0;
      for (const Vector3d& corner : BaseOf(box)) {
        const Vector3d middle(corner.x(), corner.y(), box.centre.z());
        bounds.extend(T_kind_map * (middle - half_height_m * Vector3d::UnitZ()));
        bounds.extend(T_kind_map * (middle + half_height_m * Vector3d::UnitZ()));
      }
    }
  }
  return {bounds.min() - Vector3d::Constant(kMarginM), bounds.max() + Vector3d::Constant(kMarginM)};
}

std::size_t ThingsAtATime(const Eigen::AlignedBox3d& box, double voxel_m) {
  const double voxels = (box.sizes() / voxel_m).array().ceil().prod();
  const double most = static_cast<double>(kMostThingViews);
  return static_cast<std::size_t>(std::clamp(kMostVoxelsAtATime / voxels, 1.0, most));
}

double ShapeVoxelM(const Eigen::AlignedBox3d& box, double voxel_m) {
  // Borders of voxels are not those of the box.
  const double most = 0.9 * kMostShapeVoxels;
  while ((box.sizes() / voxel_m).array().ceil().prod() > most) voxel_m *= 1.1;
  return voxel_m;
}

absl::StatusOr<ThingViews> ReadThingViews(MapCore& core,
                                          std::uint64_t epoch,
                                          std::span<const WholeThing> things,
                                          const Eigen::AlignedBox3d& box,
                                          double voxel_m,
                                          DamagedScans& damaged,
                                          const Stop& stop) {
  ThingViews out;
  for (std::size_t i = 0; i < things.size(); ++i) {
    STRATA_ASSIGN_OR_RETURN(ShapeView view, ShapeView::Over(box, voxel_m));
    out.views.push_back(std::move(view));
  }
  ViewReader views(core, things, out);
  for (const auto& [id, seen] : ScansOf(things)) {
    STRATA_RETURN_IF_ERROR(stop.status());
    const absl::StatusOr<PosedScan> posed = FindScan(core, id, epoch);
    if (absl::IsNotFound(posed.status())) continue;  // deleted meanwhile
    STRATA_RETURN_IF_ERROR(posed.status());
    if (!posed->pose.has_value() || !posed->scan.has_points) continue;
    // Also of one that breaks off: what it has added stays.
    out.scans.insert(posed->scan.number);
    const absl::Status added = views.Add(*posed, seen, stop);
    if (added.ok()) continue;
    if (absl::IsFailedPrecondition(added)) continue;  // its points were dropped meanwhile
    if (!damaged.LeaveOut(posed->scan.number, id.ToString(), added)) return added;
  }
  return out;
}

}  // namespace strata
