// A car whose way is known: five loops of 2.3 km on 300 × 250 m, with a garage and walls that
// reflect GPS (as the one of the thesis' 10.3).
#ifndef STRATA_TESTS_EXPERIMENTS_SIMULATED_CAR_H_
#define STRATA_TESTS_EXPERIMENTS_SIMULATED_CAR_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "absl/status/statusor.h"

#include "core/egomotion/motion_log.h"
#include "tests/support/simulator/simulated_drive.h"

namespace strata::testing {

inline constexpr double kEarthM = 6.37e6;  // radius

// Ellipses that begin and end at one gate, each inside the one before, at 8 m/s; level, or on the
// ground of CampusHeight().
DriveOptions CarDrive(bool on_terrain);
double CarWayM();

struct Urban {
  MotionLog log;
  std::vector<bool> bad;  // which fixes are off by more than 5 m
};

// What its sensors say: no GPS in a garage and under two bridges; beside walls fixes jump by up to
// 30 m for one to four seconds, and one wall draws them away slowly.
Urban AmongWalls(const DriveOptions& options, std::uint64_t seed);

struct WrittenCar {
  std::size_t scans = 0;
  std::size_t points = 0;
};

// A scan every `step_m` along the true way of a drive on terrain, among houses and trees, and roofs
// where GPS is hidden.
//   FOLDER/log, FOLDER/odometry     imu.csv, odom.csv, gps.csv; in the second the fixes of the
//   first
//                                   30 s only
//   FOLDER/rig.yaml
//   FOLDER/scans/1003.140000.pcd    by their times
//   FOLDER/truth.txt                TUM, of the sensor
absl::StatusOr<WrittenCar> WriteCar(const DriveOptions& options,
                                    const Urban& urban,
                                    double step_m,
                                    std::uint64_t seed,
                                    const std::filesystem::path& folder);

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_SIMULATED_CAR_H_
