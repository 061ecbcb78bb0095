// Which of the scans in place a new scan is matched to, and the way of ingest around it.
//
// What was measured to work without loop closing (tests/experiments/ingest_chain.cc):
//   - predict: last corrected pose of the trajectory · uploaded relative motion;
//   - features from a map of the scan in its own frame with cells of 0.1 m, whatever the world's:
//     at 0.2 m the error nearly doubles; walls where their points are (upright_offsets.h);
//   - target: SelectNeighbours() with the defaults, TargetOptions::centre at the prediction;
//   - accept kConverged, kMaxIterations and kDegenerate (not moved where undetermined); with
//     kTooLittleOverlap or kDiverged keep the prediction. The least overlap of an accepted scan was
//     0.46 (facade), so min_overlap of 0.3 leaves room.
//   - 4000 samples: with 2000 the campus closes 0.1 to 1 m off, by the seed.
// Sample seeds 1 and 2: NCLT campus, 636 m, off by 0.75 and 0.73 m, 1.1° and 1.0°, at its closure
// (uploaded 17.9 m), KITTI drive with noisy steps ATE 11 to 13 mm, hall 13 mm (uploaded 61), facade
// 3 mm (35). Surface elements of 20 features, or σt of 0.5 m, let the campus drift by 1 m and more.
#ifndef STRATA_CORE_REGISTRATION_NEIGHBOURS_H_
#define STRATA_CORE_REGISTRATION_NEIGHBOURS_H_

#include <cstddef>
#include <span>
#include <vector>

#include "absl/status/status.h"

#include "core/geometry/pose.h"

namespace strata {

// A robot that comes back to a place after more scans than this is on another pass.
inline constexpr std::size_t kOwnPass = 30;

// Scans of another pass that are higher or lower than this are on another storey, which may look
// the same.
inline constexpr double kSameStoreyM = 1.5;

struct NeighbourPolicy {
  // Scans whose origins are farther than this from the guess are no neighbours [m]; in (0, 1000].
  // Less, and a robot whose only neighbours look down on it from a bridge tilts with them.
  double radius_m = 40.0;
  // At most so many; in [1, 1000]. 8 drift a little more, 25 to 60 no less.
  int max_scans = 15;

  absl::Status Validate() const;
};

// Indices into `T_map_scans` of the scans to match to: the nearest to the guess by origin, ties to
// the later one (the last placed agrees best with what comes next), in ascending order. Empty when
// none is within the radius. A pure function.
std::vector<std::size_t> SelectNeighbours(std::span<const Pose> T_map_scans,
                                          const Pose& T_map_source_guess,
                                          const NeighbourPolicy& policy = {});

}  // namespace strata

#endif  // STRATA_CORE_REGISTRATION_NEIGHBOURS_H_
