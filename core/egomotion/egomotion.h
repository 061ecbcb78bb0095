// From a log of IMU, wheels and GPS to a trajectory on earth (thesis 10.2.1).
#ifndef STRATA_CORE_EGOMOTION_EGOMOTION_H_
#define STRATA_CORE_EGOMOTION_EGOMOTION_H_

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/common/stop.h"
#include "core/egomotion/fused_state.h"
#include "core/egomotion/motion_log.h"
#include "core/egomotion/rig.h"
#include "core/egomotion/trajectory.h"
#include "core/world/map_info.h"

namespace strata {

// What became of a fix, in the order of the log's times.
struct FixOutcome {
  double time_s = 0.0;                                  // without the receiver's lag
  Eigen::Vector3d antenna_m = Eigen::Vector3d::Zero();  // where it says the antenna was, in the map
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Ones();    // as it counted
  Eigen::Vector3d innovation_m = Eigen::Vector3d::Zero();  // measured − predicted
  double horizontal_nis = 0.0;                             // 2 degrees of freedom
  bool used = false;
};

// The state was moved to where fixes agreed that it is.
struct Recovery {
  double time_s = 0.0;
  double moved_m = 0.0;
  double turned_rad = 0.0;
};

// No fix was used for longer than kFixGapS.
inline constexpr double kFixGapS = 5.0;
struct FixGap {
  double begin_s = 0.0, end_s = 0.0;
};

struct EgomotionReport {
  std::size_t fixes = 0, used = 0, rejected = 0;  // without those before the first pose
  std::vector<Recovery> recoveries;
  std::vector<FixGap> gaps;
  double innovation_rms_m = 0.0;  // horizontal, of used fixes
  double mean_nis = 0.0;          // horizontal, of used fixes: 2 where σ is as good as it says
  double duration_s = 0.0;
  double distance_m = 0.0;
  bool rested_at_start = false;
  double heading_at_start_rad = 0.0;  // counter-clockwise from east
  // At the end, with σ.
  FusedState last;
  StateVector last_sigma = StateVector::Zero();
};

struct Egomotion {
  GeodeticOrigin origin;  // as asked for, or the first fix
  Eigen::Quaterniond R_body_imu = Eigen::Quaterniond::Identity();
  Trajectory trajectory;           // 20 poses a second, and the first and the last
  std::vector<FusedState> states;  // as many, without lag
  std::vector<FixOutcome> fixes;
  EgomotionReport report;
};

// What a run along a log has found so far.
struct EgomotionSoFar {
  const std::vector<TrajectoryPose>& poses;
  const std::vector<FixOutcome>& fixes;
  double end_s = 0.0;  // of the log
};

struct EgomotionOptions {
  // Where the map's frame is on earth; nullopt: at the first fix.
  std::optional<GeodeticOrigin> origin;
  // Told, if set, each time a second of poses has become known, and at the end; the first time
  // once the heading at the start is. An error of it ends the run.
  std::function<absl::Status(const EgomotionSoFar&)> told;
  // Which way the body's x points at the start, counter-clockwise from east; nullopt: the most
  // likely of several over the first metres.
  std::optional<double> heading_rad;
};

// Forward in time: a pose knows what was measured before it. Starts level by gravity; with the
// gyroscope's mean as its bias if the robot stands for the first 2 s.
// INVALID_ARGUMENT, naming sensor and time: no IMU or no fix, times that do not ascend, numbers
// that are not finite, an IMU that is silent for more than a second, a rig out of range, an origin
// more than 100 km from the first fix;
// FAILED_PRECONDITION as FindMounting(); CANCELLED or DEADLINE_EXCEEDED by `stop`.
absl::StatusOr<Egomotion> FilterLog(const MotionLog& log,
                                    const Rig& rig,
                                    const EgomotionOptions& options = {},
                                    const Stop& stop = Stop());

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_EGOMOTION_H_
