#include "client/cli/mesh/scan_clouds.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>

#include "client/cli/terminal/world_json.h"
#include "core/api/scans.h"
#include "core/common/status.h"
#include "core/world/map_class.h"
#include "core/world/map_info.h"

namespace strata::cli {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

// NaN where `drop` says so: a grid keeps its places.
template <typename Drop>
void DropPoints(PointCloud& cloud, const Drop& drop) {
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (drop(i)) cloud.points[i].setConstant(kNothing);
  }
}

// Those that are integrated and may have points in the region.
absl::StatusOr<std::vector<ScanInfo>> ScansOf(Context& context, const MeshOptions& options) {
  std::vector<ScanInfo> scans;
  if (options.one_scan) {
    STRATA_ASSIGN_OR_RETURN(scans.emplace_back(),
                            context.database.scans().Get(context.call, options.map, options.scan));
    return scans;
  }
  api::ScanFilter filter;
  filter.state = ScanState::kIntegrated;
  if (options.region.has_value()) {
    filter.box =
        Eigen::AlignedBox2d(options.region->min().head<2>(), options.region->max().head<2>());
  }
  STRATA_RETURN_IF_ERROR(
      context.database.scans().List(context.call, options.map, filter, [&](const ScanInfo& scan) {
        // A robot's local map has no points.
        if (scan.header.point_count > 0) scans.push_back(scan);
        return absl::OkStatus();
      }));
  return scans;
}

absl::Status NoScans(Context& context, const MeshOptions& options) {
  STRATA_ASSIGN_OR_RETURN(const MapStats stats,
                          context.database.maps().Stats(context.call, options.map));
  if (stats.scans == stats.scans_pending + stats.scans_failed) {
    return absl::FailedPreconditionError(
        absl::StrCat("map ", options.map, " has no integrated scans: import some, or wait"));
  }
  return absl::NotFoundError(absl::StrCat("no scan of map ",
                                          options.map,
                                          " with points reaches into the region; the map lies ",
                                          ExtentOf(stats)));
}

}  // namespace

absl::Status DroppedPoints(const std::string& map) {
  return absl::FailedPreconditionError(
      absl::StrCat("map ",
                   map,
                   " has dropped the points of its scans; what is left are its surfaces, which "
                   "strata map export ",
                   map,
                   " --format ply writes"));
}

absl::StatusOr<PosedCloud> ReadPosedCloud(Context& context,
                                          const MapInfo& map,
                                          const ScanInfo& scan) {
  api::Scans& scans = context.database.scans();
  PosedCloud posed;
  posed.T_map_scan = scan.T_map_scan;
  posed.sensor = scan.header.sensor.value_or(map.parameters.sensor);
  PointCloud& cloud = posed.cloud;
  cloud.sensor_origin = scan.header.sensor_origin;
  cloud.rows = scan.header.rows;
  cloud.columns = scan.header.columns;
  STRATA_RETURN_IF_ERROR(
      scans.GetPoints(context.call, map.name, scan.header.id, [&](const PointCloud& piece) {
        const auto append = [](auto& to, const auto& from) {
          to.insert(to.end(), from.begin(), from.end());
        };
        append(cloud.points, piece.points);
        append(cloud.colour, piece.colour);
        // Some pieces have labels and some not where a person labelled a part.
        cloud.label.resize(cloud.size() - piece.size(), 0);
        append(cloud.label, piece.label);
        cloud.label.resize(cloud.size(), 0);
        return absl::OkStatus();
      }));
  if (scan.faded_points == 0) return posed;
  STRATA_ASSIGN_OR_RETURN(const std::vector<std::uint16_t> faded,
                          scans.GetFaded(context.call, map.name, scan.header.id));
  DropPoints(cloud, [&](std::size_t p) { return p < faded.size() && faded[p] != 0; });
  return posed;
}

absl::StatusOr<ScanClouds> ScanClouds::Find(Context& context, const MeshOptions& options) {
  ScanClouds clouds;
  clouds.options_ = options;
  STRATA_ASSIGN_OR_RETURN(clouds.map_, context.database.maps().Get(context.call, options.map));
  if (!options.class_name.empty()) {
    STRATA_ASSIGN_OR_RETURN(const std::vector<MapClass> classes,
                            context.database.maps().ListClasses(context.call, options.map));
    STRATA_ASSIGN_OR_RETURN(clouds.class_id_, ClassIdOf(classes, options.class_name));
  }
  STRATA_ASSIGN_OR_RETURN(clouds.scans_, ScansOf(context, options));
  if (clouds.scans_.empty()) return NoScans(context, options);
  if (!clouds.map_.parameters.keep_points) return DroppedPoints(options.map);
  return clouds;
}

bool ScanClouds::has_colour() const {
  return std::any_of(
      scans_.begin(), scans_.end(), [](const ScanInfo& scan) { return scan.header.has_colour; });
}

absl::StatusOr<PosedCloud> ScanClouds::Read(Context& context, std::size_t i) const {
  STRATA_ASSIGN_OR_RETURN(PosedCloud posed, ReadPosedCloud(context, map_, scans_[i]));
  if (options_.one_scan) posed.T_map_scan = Pose::Identity();
  return posed;
}

void ScanClouds::KeepClass(PointCloud& cloud) const {
  if (!class_id_.has_value()) return;
  DropPoints(cloud, [&](std::size_t p) { return cloud.label[p] != *class_id_; });
}

}  // namespace strata::cli
