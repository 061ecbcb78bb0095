// A small map that fuzzers ask and damage.
#ifndef STRATA_TESTS_FUZZ_SMALL_WORLD_H_
#define STRATA_TESTS_FUZZ_SMALL_WORLD_H_

#include <filesystem>

#include "core/cloud/point_cloud.h"
#include "core/world/robot_profile.h"
#include "core/world/scan.h"
#include "tests/support/temp_dir.h"

namespace strata::fuzz {

// The map and the trajectory of its scans, which are numbered from 1 on.
inline constexpr char kWorld[] = "world";
inline constexpr int kWorldScans = 3;
inline constexpr int kWorldPoints = 500;        // of each scan, all labelled 1 or 2
inline constexpr double kWorldCellSizeM = 0.4;  // its points lie densely enough to drive on
inline constexpr char kWorldClassifier[] = "first";

// It finds a path from (-6, 0.7) to (1, 2).
inline constexpr RobotProfile kWorldRobot = {.radius_m = 0.2,
                                             .height_m = 0.3,
                                             .max_step_m = 2.0,
                                             .max_slope_rad = 1.4,
                                             .max_gap_m = 1.0,
                                             .max_roughness_m = 5.0};

struct WorldScan {
  ScanHeader header;
  PointCloud cloud;
};
// The scan whose upload broke off half-way, announced.
WorldScan BrokenOffScan();

// Three overlapping scans in their second epoch, a fourth whose upload broke off, a class, a
// constraint, a classifier: in a closed file, made once.
class SmallWorld {
 public:
  SmallWorld();

  // Into a new directory of maps.
  void CopyTo(const std::filesystem::path& directory) const;

 private:
  testing::TempDir directory_;
};

}  // namespace strata::fuzz

#endif  // STRATA_TESTS_FUZZ_SMALL_WORLD_H_
