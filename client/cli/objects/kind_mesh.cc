#include "client/cli/objects/kind_mesh.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include <Eigen/Geometry>

#include "client/cli/mesh/scan_clouds.h"
#include "client/cli/objects/fetched_entities.h"
#include "core/api/scans.h"
#include "core/common/status.h"
#include "core/mesh/density_contour.h"
#include "core/mesh/distance_field.h"
#include "core/world/map_info.h"

namespace strata::cli {
namespace {

using Eigen::Vector3d;

constexpr double kAroundKindM = 0.2;
constexpr double kAroundThingM = 0.05;
constexpr std::size_t kMostScansOfOne = 24;  // of each thing, those that saw most

TriangleMesh ImportedMesh(const KindShape& shape) {
  TriangleMesh mesh;
  for (const Eigen::Vector3f& v : shape.vertices) mesh.vertices.push_back(v.cast<double>());
  mesh.triangles.assign(shape.triangles.begin(), shape.triangles.end());
  return mesh;
}

// The scans of the things, with the things that each saw.
using Sights = std::map<ScanId, std::vector<const Entity*>>;

Sights SightsOf(const std::vector<Entity>& things) {
  Sights sights;
  for (const Entity& thing : things) {
    std::vector<EntityScan> seen = thing.scans;
    std::stable_sort(seen.begin(), seen.end(), [](const EntityScan& a, const EntityScan& b) {
      return a.points > b.points;
    });
    if (seen.size() > kMostScansOfOne) seen.resize(kMostScansOfOne);
    for (const EntityScan& scan : seen) sights[scan.scan].push_back(&thing);
  }
  return sights;
}

// Of the scan the points of the thing alone.
PointCloud PointsOfThing(const PosedCloud& posed, const Entity& thing) {
  PointCloud part;
  part.origin = posed.cloud.origin;
  part.sensor_origin = posed.cloud.sensor_origin;
  const Eigen::AngleAxisd turned(-thing.box.yaw_rad, Vector3d::UnitZ());
  for (std::size_t i = 0; i < posed.cloud.size(); ++i) {
    if (posed.cloud.label[i] != thing.class_id) continue;
    const Eigen::Vector3f& p = posed.cloud.points[i];
    const Vector3d at = posed.T_map_scan * (p.cast<double>() + posed.cloud.origin);
    const Vector3d from = turned * (at - thing.box.centre);
    const Vector3d most = thing.box.size / 2.0 + Vector3d::Constant(kAroundThingM);
    if ((from.cwiseAbs().array() <= most.array()).all()) part.points.push_back(p);
  }
  return part;
}

// All things of a kind over each other, in one field.
class LaidOver {
 public:
  LaidOver(Context& context, const MapInfo& map, const ThingKind& kind, double voxel_m)
      : context_(context), map_(map), field_(OptionsOf(kind, voxel_m)) {}

  absl::StatusOr<TriangleMesh> Mesh(const Sights& sights) {
    const Stop& stop = context_.call.stop;
    STRATA_RETURN_IF_ERROR(ForEach(sights, [&](const PosedCloud& posed, const Entity& thing) {
      return field_.Add(PointsOfThing(posed, thing), PoseOf(posed, thing), posed.sensor, stop);
    }));
    STRATA_RETURN_IF_ERROR(ForEach(sights, [&](const PosedCloud& posed, const Entity& thing) {
      return field_.Carve(posed.cloud, PoseOf(posed, thing), posed.sensor, stop);
    }));
    return field_.Mesh(stop);
  }

 private:
  static DistanceFieldOptions OptionsOf(const ThingKind& kind, double voxel_m) {
    DistanceFieldOptions options{.voxel_m = voxel_m};
    options.region.setEmpty();
    for (const Eigen::Vector3f& p : kind.shape.points) options.region.extend(p.cast<double>());
    options.region.min().array() -= kAroundKindM;
    options.region.max().array() += kAroundKindM;
    return options;
  }
  static Pose PoseOf(const PosedCloud& posed, const Entity& thing) {
    return thing.kind->T_map_kind.inverse() * posed.T_map_scan;
  }

  absl::Status ForEach(const Sights& sights,
                       absl::FunctionRef<absl::Status(const PosedCloud&, const Entity&)> body) {
    for (const auto& [id, things] : sights) {
      STRATA_RETURN_IF_ERROR(context_.call.stop.status());
      STRATA_ASSIGN_OR_RETURN(const ScanInfo scan,
                              context_.database.scans().Get(context_.call, map_.name, id));
      STRATA_ASSIGN_OR_RETURN(const PosedCloud posed, ReadPosedCloud(context_, map_, scan));
      for (const Entity* thing : things) STRATA_RETURN_IF_ERROR(body(posed, *thing));
    }
    return absl::OkStatus();
  }

  Context& context_;
  const MapInfo& map_;
  DistanceField field_;
};

absl::StatusOr<KindMesh> Contour(const ThingKind& kind, double voxel_m, const Stop& stop) {
  std::vector<Vector3d> points;
  for (const Eigen::Vector3f& p : kind.shape.points) points.push_back(p.cast<double>());
  DensityContourOptions options;
  options.voxel_m = voxel_m;
  KindMesh made;
  made.method = "contour";
  STRATA_ASSIGN_OR_RETURN(made.mesh, ContourDensity(points, options, stop));
  if (!made.mesh.triangles.empty()) return made;
  return absl::FailedPreconditionError(absl::StrFormat(
      "%d points of kind %s make no triangle: they are too far apart for voxels of %g m; larger "
      "ones may do",
      points.size(),
      KindIdText(kind.info.id),
      voxel_m));
}

}  // namespace

absl::StatusOr<KindMesh> MeshOfKind(Context& context,
                                    const std::string& map,
                                    const ThingKind& kind,
                                    double voxel_m) {
  KindMesh made;
  if (!kind.shape.triangles.empty()) {
    made.method = "imported";
    made.mesh = ImportedMesh(kind.shape);
    return made;
  }
  EntityQuery query;
  query.kind = KindIdText(kind.info.id);
  const absl::StatusOr<FetchedEntities> fetched = FetchEntities(context, map, query, "");
  if (!fetched.ok() && !absl::IsNotFound(fetched.status())) return fetched.status();
  STRATA_ASSIGN_OR_RETURN(const MapInfo info, context.database.maps().Get(context.call, map));
  if (!fetched.ok() || fetched->entities.empty() || !info.parameters.keep_points) {
    return Contour(kind, voxel_m, context.call.stop);
  }
  const Sights sights = SightsOf(fetched->entities);
  STRATA_ASSIGN_OR_RETURN(made.mesh, LaidOver(context, info, kind, voxel_m).Mesh(sights));
  if (made.mesh.triangles.empty()) return Contour(kind, voxel_m, context.call.stop);
  made.method = "tsdf";
  made.things = fetched->entities.size();
  made.scans = sights.size();
  return made;
}

}  // namespace strata::cli
