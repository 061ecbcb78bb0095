// Some scans get other poses: how the rest of the world follows.
#ifndef STRATA_CORE_ENGINE_INGEST_POSE_CHANGE_H_
#define STRATA_CORE_ENGINE_INGEST_POSE_CHANGE_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
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
    std::size_t carried = 0;          // scans nobody decided on that follow others, moved or not
  };
  // Scans that nobody decided on keep their place relative to one that was decided on: the nearest
  // of those that constraints hold them against, or else of the two beside them on their
  // trajectory; or, where there is none, relative to one that is carried so, and so on. What
  // nothing leads to stays.
  Outcome Resolve(const MoveTolerance& tolerance) const;

 private:
  // Indices into scans_ that a scan can be carried by.
  struct Partners {
    std::vector<std::size_t> held;    // by a constraint, older or younger
    std::vector<std::size_t> beside;  // on the trajectory
  };
  // Where every scan is from now on; what stays undecided is empty.
  std::vector<std::optional<Pose>> Carry() const;
  std::optional<std::size_t> NearestOf(std::size_t scan,
                                       const std::vector<std::size_t>& partners,
                                       const std::vector<std::optional<Pose>>& after) const;

  std::vector<PosedScan> scans_;
  std::vector<Partners> partners_;  // beside scans_
  std::map<ScanNumber, Pose> decided_;
};

}  // namespace strata

#endif  // STRATA_CORE_ENGINE_INGEST_POSE_CHANGE_H_
