// Some scans get other poses: how the rest of the world follows.
#ifndef STRATA_CORE_ENGINE_POSE_CHANGE_H_
#define STRATA_CORE_ENGINE_POSE_CHANGE_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "absl/status/statusor.h"

#include "core/storage/storage.h"

namespace strata {

// Scans that would move less than both keep their pose.
struct MoveTolerance {
  double translation_m = 0.005;
  double rotation_rad = 0.0005;
};

// The integrated scans of one epoch. Not thread-safe.
class PoseChange {
 public:
  static absl::StatusOr<PoseChange> Read(StorageReader& reader, std::uint64_t epoch);

  const std::vector<PosedScan>& scans() const { return scans_; }  // by number, each with its pose
  // Where a scan is from now on; it may stay. Scans that are not in the map are ignored.
  void Decide(ScanNumber scan, const Pose& T_map_scan) { decided_[scan] = T_map_scan; }

  struct Outcome {
    std::vector<ProposedPose> moves;  // by number
    std::size_t carried = 0;          // scans nobody decided on, moved or not
  };
  // Scans that nobody decided on keep their place relative to the nearest of the scans they were
  // held against when they were integrated, or relative to the one before on their trajectory.
  Outcome Resolve(const MoveTolerance& tolerance) const;

 private:
  std::vector<PosedScan> scans_;
  std::map<ScanNumber, std::vector<ScanNumber>> partners_;  // of every scan, older, nearest first
  std::map<ScanNumber, Pose> decided_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_POSE_CHANGE_H_
