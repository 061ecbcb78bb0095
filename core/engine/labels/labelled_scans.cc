#include "core/engine/labels/labelled_scans.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "core/classification/regions.h"
#include "core/common/status.h"
#include "core/engine/map/scan_lookup.h"
#include "core/engine/scans/scan_source.h"
#include "core/world/map_class.h"

namespace strata {
namespace {

// How many points of the scan have each class.
using ClassCounts = std::map<std::uint16_t, std::uint64_t>;

absl::StatusOr<ClassCounts> CountClasses(MapCore& core, const ScanRecord& scan) {
  ClassCounts counts;
  STRATA_RETURN_IF_ERROR(ForEachUprightPart(core, scan, [&](const PointCloud& part) {
    for (const std::uint16_t label : part.label) {
      if (label > 0 && label <= kMaxClassId) ++counts[label];
    }
    return absl::OkStatus();
  }));
  return counts;
}

absl::StatusOr<std::vector<PosedScan>> ScansWithLabels(MapCore& core) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  std::vector<PosedScan> scans;
  ScanQuery query;
  query.skip_damaged = true;  // verify names it
  const std::uint64_t epoch = core.snapshots().current().epoch;
  STRATA_RETURN_IF_ERROR(ForEachScan(*reader, query, epoch, [&](PosedScan posed) {
    const bool labelled = posed.scan.header.has_label || posed.scan.person_labels;
    if (labelled && posed.scan.has_points) scans.push_back(std::move(posed));
  }));
  return scans;
}

// Where it is now, or where it was uploaded to be.
const Pose& PoseOf(const PosedScan& posed) {
  return posed.pose.has_value() ? posed.pose->T_map_scan : posed.scan.header.T_map_scan;
}

}  // namespace

absl::Status ForEachUprightPart(MapCore& core,
                                const ScanRecord& scan,
                                absl::FunctionRef<absl::Status(const PointCloud&)> use) {
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
  const MapParameters parameters = core.info().parameters;
  const Eigen::Matrix3f R_map_scan = scan.header.T_map_scan.linear().cast<float>();
  ScanSource source(*reader, parameters, {.models = false});
  return source.ForEachBlock(scan, [&](const PointCloud& block) {
    PointCloud upright = block;
    upright.sensor_origin = R_map_scan * block.sensor_origin;
    for (Eigen::Vector3f& point : upright.points) point = R_map_scan * point;
    return use(upright);
  });
}

absl::Status LabelledScans::Visit(std::size_t k,
                                  absl::FunctionRef<absl::Status(const PointCloud&)> use) const {
  const absl::Status done = ForEachUprightPart(*core_, scans_[k], use);
  if (!absl::IsDataLoss(done)) return done;
  STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core_->Reader());
  STRATA_ASSIGN_OR_RETURN(const bool there, IsThere(*reader, scans_[k].number, 0));
  return there ? done : absl::OkStatus();
}

std::vector<std::size_t> LabelledScans::Regions(double edge_m) const {
  if (edge_m > 0.0) return RegionsOf(places_, edge_m);
  std::vector<std::size_t> each(scans_.size());
  std::iota(each.begin(), each.end(), std::size_t{0});
  return each;
}

absl::StatusOr<LabelledScans> LabelledScans::Read(MapCore& core,
                                                  DamagedScans& damaged,
                                                  JobContext& context) {
  STRATA_ASSIGN_OR_RETURN(const std::vector<PosedScan> candidates, ScansWithLabels(core));
  LabelledScans labelled(core);
  ClassCounts counts;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    STRATA_RETURN_IF_ERROR(context.Progress(
        static_cast<double>(i) / static_cast<double>(candidates.size()), "reading labels"));
    const ScanRecord& scan = candidates[i].scan;
    const absl::StatusOr<ClassCounts> more = CountClasses(core, scan);
    if (absl::IsDataLoss(more.status())) {
      STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
      damaged.LeaveOut(*reader, scan.number, scan.header.id.ToString(), more.status());
      continue;
    }
    STRATA_RETURN_IF_ERROR(more.status());
    if (more->empty()) continue;
    labelled.scans_.push_back(scan);
    labelled.places_.emplace_back(PoseOf(candidates[i]).translation().head<2>());
    for (const auto& [label, points] : *more) counts[label] += points;
  }
  std::vector<MapClass> table;
  {
    STRATA_ASSIGN_OR_RETURN(const ReaderPool::Lease reader, core.Reader());
    STRATA_ASSIGN_OR_RETURN(table, reader->ListClasses());
  }
  for (const auto& [label, points] : counts) {
    labelled.classes_.push_back({label, ClassOf(table, label).name});
    labelled.points_ += points;
  }
  return labelled;
}

}  // namespace strata
