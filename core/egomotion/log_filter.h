// One run of the filter along a log from one guess of the heading. Internal to core/egomotion, not
// installed.
#ifndef STRATA_CORE_EGOMOTION_LOG_FILTER_H_
#define STRATA_CORE_EGOMOTION_LOG_FILTER_H_

#include <cstddef>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/egomotion/egomotion.h"
#include "core/egomotion/gps_gate.h"
#include "core/egomotion/information_filter.h"
#include "core/egomotion/motion_log.h"
#include "core/egomotion/rig.h"
#include "core/egomotion/trajectory.h"

namespace strata {

// A fix in the map, without lag.
struct MapFix {
  double time_s = 0.0;
  Eigen::Vector3d antenna_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Ones();
};

// Without lags, times ascending.
struct MapLog {
  std::vector<ImuSample> imu;
  std::vector<WheelSample> wheels;
  std::vector<MapFix> fixes;
};

// Where a run begins.
struct FilterStart {
  FusedState state;
  StateMatrix covariance = StateMatrix::Identity();
};

class LogFilter {
 public:
  // Both outlive it; `rig` has R_body_imu.
  LogFilter(const MapLog& log, const Rig& rig, const FilterStart& start);

  bool done() const { return next_imu_ >= log_->imu.size(); }
  // On to the next sample of the IMU and through all that was measured until then.
  void Step();
  // From now on fixes are judged. Before, only what no start explains is left out.
  void Settle() { settled_ = true; }

  double time_s() const { return filter_.state().time_s; }
  double log_likelihood() const { return log_likelihood_; }  // of the fixes until now
  double distance_m() const { return distance_m_; }
  // Which way the body's x pointed at the start by what is known now: the heading now without the
  // turns that the gyroscope felt since. In (−π, π].
  double HeadingAtStart() const;
  const InformationFilter& filter() const { return filter_; }
  const std::vector<TrajectoryPose>& poses() const { return poses_; }
  const std::vector<FusedState>& states() const { return states_; }
  const std::vector<FixOutcome>& fixes() const { return fixes_; }
  const std::vector<Recovery>& recoveries() const { return recoveries_; }

  // Writes the pose where the filter is unless it just did; `always` for the last one.
  void Record(bool always);

 private:
  // The IMU's reading between the samples before and after now.
  ImuSample Reading() const;
  void PredictTo(double time_s);
  void OnWheels(const WheelSample& sample);
  void OnFix(const MapFix& fix);
  void OnRejected(const MapFix& fix, const StateMeasurement<3>& position);

  const MapLog* log_;
  const Rig* rig_;
  InformationFilter filter_;
  GpsGate gate_;
  bool settled_ = false;
  std::size_t next_imu_ = 1, next_wheel_ = 0, next_fix_ = 0;
  double stands_since_s_;
  double log_likelihood_ = 0.0;
  double distance_m_ = 0.0;
  double turned_rad_ = 0.0;  // by predictions alone
  std::vector<TrajectoryPose> poses_;
  std::vector<FusedState> states_;
  std::vector<FixOutcome> fixes_;
  std::vector<Recovery> recoveries_;
};

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_LOG_FILTER_H_
