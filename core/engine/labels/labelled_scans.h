// Scans as classifiers see them.
#ifndef STRATA_CORE_ENGINE_LABELS_LABELLED_SCANS_H_
#define STRATA_CORE_ENGINE_LABELS_LABELLED_SCANS_H_

#include <cstdint>
#include <map>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"

#include "core/classification/classifier.h"
#include "core/engine/map/job_context.h"
#include "core/engine/map/map_core.h"
#include "core/engine/scans/damaged_scans.h"
#include "core/storage/storage.h"

namespace strata {

// Hands the points of a scan to `use`, in parts of about a million, in order: turned so that z is
// up as the uploaded pose has it. So they do not depend on what a map does with a scan, nor on
// when. Labels are those that people gave or uploaded.
absl::Status ForEachUprightPart(MapCore& core,
                                const ScanRecord& scan,
                                absl::FunctionRef<absl::Status(const PointCloud&)> use);

// The scans of a map that people have labelled points of, in commit order.
class LabelledScans {
 public:
  // Counts every label once. Scans that cannot be read are put into `damaged`.
  static absl::StatusOr<LabelledScans> Read(MapCore& core,
                                            DamagedScans& damaged,
                                            JobContext& context);

  std::size_t size() const { return scans_.size(); }
  // The classes there are points of; their names are those of the map.
  const std::vector<ClassName>& classes() const { return classes_; }
  std::uint64_t points() const { return points_; }  // labelled ones
  // Which square of `edge_m` every scan was taken in (RegionsOf); 0: each scan is a region.
  std::vector<std::size_t> Regions(double edge_m) const;
  // Hands on scan `k`, as a CloudSource does; nothing, or no more, of one that was deleted.
  absl::Status Visit(std::size_t k, absl::FunctionRef<absl::Status(const PointCloud&)> use) const;

 private:
  explicit LabelledScans(MapCore& core) : core_(&core) {}

  MapCore* core_;
  std::vector<ScanRecord> scans_;
  std::vector<Eigen::Vector2d> places_;  // of `scans_`, where they were taken
  std::vector<ClassName> classes_;
  std::uint64_t points_ = 0;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_LABELS_LABELLED_SCANS_H_
