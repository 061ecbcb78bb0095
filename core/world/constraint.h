// What is known about poses beyond the poses themselves.
#ifndef STRATA_CORE_WORLD_CONSTRAINT_H_
#define STRATA_CORE_WORLD_CONSTRAINT_H_

#include <cstdint>
#include <string>

#include "core/geometry/pose.h"
#include "core/world/scan.h"

namespace strata {

// Who says so.
enum class ConstraintOrigin : std::uint8_t {  // stored
  kIngest = 1,                                // registration while the scan was integrated
  kPerson = 2,                                // set by hand
};

// A local constraint: the relative pose of two scans (thesis 7.10, `T_i_j` = P_i⁻¹ P_j).
struct Constraint {
  std::uint64_t id = 0;  // unique in the map
  ScanId i;
  ScanId j;
  Pose T_i_j = Pose::Identity();
  Matrix6d information =
      Matrix6d::Identity();  // [rotation, translation], of a right-hand step on T_i_j
  ConstraintOrigin origin = ConstraintOrigin::kIngest;
  bool enabled = true;
  std::string note;
};

// A scan in the pose graph of the current epoch.
struct PoseNode {
  ScanId id;
  absl::Time time;
  ScanState state = ScanState::kPending;
  Pose T_map_scan_uploaded = Pose::Identity();
  Pose T_map_scan = Pose::Identity();
};

}  // namespace strata

#endif  // STRATA_CORE_WORLD_CONSTRAINT_H_
