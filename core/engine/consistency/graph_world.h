// The integrated scans of a map and what holds them, as the nodes of one pose graph.
#ifndef STRATA_CORE_ENGINE_CONSISTENCY_GRAPH_WORLD_H_
#define STRATA_CORE_ENGINE_CONSISTENCY_GRAPH_WORLD_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "absl/status/statusor.h"

#include "core/engine/consistency/optimize_settings.h"
#include "core/engine/map/map_core.h"
#include "core/engine/scans/damaged_scans.h"
#include "core/posegraph/alignment/alignment.h"
#include "core/posegraph/closures/path_uncertainty.h"
#include "core/storage/storage.h"

namespace strata {

// A graph as it was measured, for scans that have drifted apart.
struct MeasuredGraph {
  PoseGraphProblem graph;
  // What it says of two scans, without what was given as maybe false and nothing has checked: drift
  // along these is what closures are looked for and judged by.
  std::vector<GraphEdge> edges;
};

// One epoch as it was when read. Immutable.
class GraphWorld {
 public:
  // Scans whose rows are damaged are left out, and put into `damaged` unless it is nullptr.
  static absl::StatusOr<GraphWorld> Read(StorageReader& reader, DamagedScans* damaged = nullptr);
  static absl::StatusOr<GraphWorld> Read(MapCore& core, DamagedScans* damaged = nullptr);

  std::uint64_t epoch() const { return epoch_; }
  std::size_t size() const { return scans_.size(); }
  ScanNumber number(std::size_t node) const { return scans_[node].number; }
  const ScanId& id(std::size_t node) const { return scans_[node].header.id; }
  const std::vector<ScanRecord>& Scans() const { return scans_; }  // by number
  const std::vector<Pose>& Poses() const { return poses_; }
  // Nodes of every trajectory, by sequence.
  const std::vector<std::vector<std::size_t>>& Trajectories() const { return trajectories_; }
  // Where in Trajectories() a node is.
  struct Place {
    std::size_t trajectory = 0;
    std::size_t index = 0;
  };
  const Place& PlaceOf(std::size_t node) const { return places_[node]; }
  // Two scans less than this far from each other on one trajectory are of one pass by a place: that
  // they show the same says nothing.
  static constexpr std::size_t kPass = 10;
  bool SamePass(std::size_t a, std::size_t b) const;

  // What is enabled: pairs to register, constraints as they are, priors. Scans that follow each
  // other on a trajectory and are held by nothing else are a pair too.
  AlignmentProblem Problem(const OptimizeSettings& settings) const;
  // The same as measured when it was recorded.
  MeasuredGraph Measured(const OptimizeSettings& settings) const;

  PlaneRecord RecordOf(const SharedPlane& plane) const;
  std::vector<PlaneRecord> DisabledPlanes() const;

 private:
  absl::Status ReadScans(StorageReader& reader);
  // From scan to scan as uploaded.
  RelativePoseTerm Odometry(std::size_t i, std::size_t j) const;
  absl::Status FindDamagedRows(StorageReader& reader, DamagedScans& damaged) const;

  std::uint64_t epoch_ = 0;
  std::vector<ScanRecord> scans_;
  std::vector<Pose> poses_;  // beside scans_
  std::map<ScanNumber, std::size_t> nodes_;
  std::vector<std::vector<std::size_t>> trajectories_;
  std::vector<Place> places_;                  // beside scans_
  std::vector<ConstraintRecord> constraints_;  // between scans that are there
  std::vector<PlaneRecord> planes_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_CONSISTENCY_GRAPH_WORLD_H_
