// What a robot records on its drive, as files that `strata scan import` takes.
#ifndef STRATA_TESTS_SUPPORT_SIMULATOR_ROBOT_FILES_H_
#define STRATA_TESTS_SUPPORT_SIMULATOR_ROBOT_FILES_H_

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "absl/status/statusor.h"

#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"

namespace strata::testing {

struct RobotFiles {
  double step_m = 1.0;    // way between scans
  double height_m = 1.2;  // of the sensor
  std::size_t max_scans = 100'000;
  OdometryNoise noise;
  SensorOptions sensor;
};

struct WrittenRobot {
  std::size_t scans = 0;
  std::size_t points = 0;
};

// Writes
//   FOLDER/scans/scan0000.pcd    in the sensor's frame
//   FOLDER/poses_initial.txt     index-tum; odometry with noise from an exact start
//   FOLDER/poses_truth.txt       index-tum
absl::StatusOr<WrittenRobot> WriteRobot(const Scene& scene,
                                        const Robot& robot,
                                        std::uint64_t seed,
                                        const RobotFiles& files,
                                        const std::filesystem::path& folder);

}  // namespace strata::testing

#endif  // STRATA_TESTS_SUPPORT_SIMULATOR_ROBOT_FILES_H_
