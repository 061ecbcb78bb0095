// The error-state information filter (thesis 10.2.1): a state that an IMU moves, and the
// information of its 17 errors, to which measurements are added.
#ifndef STRATA_CORE_EGOMOTION_INFORMATION_FILTER_H_
#define STRATA_CORE_EGOMOTION_INFORMATION_FILTER_H_

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/egomotion/fused_state.h"
#include "core/egomotion/inertial_motion.h"
#include "core/egomotion/information_form.h"
#include "core/egomotion/measurements.h"
#include "core/egomotion/motion_log.h"
#include "core/egomotion/rig.h"

namespace strata {

// Turns a state about a vertical axis and moves it: p ← Rz(yaw) (p − pivot) + target.
struct Relocation {
  double yaw_rad = 0.0;
  Eigen::Vector3d pivot_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d target_m = Eigen::Vector3d::Zero();
  double sigma_yaw_rad = 0.0;  // 0: the turn is as well known as before
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Ones();
};

class InformationFilter {
 public:
  // `rig` with R_body_imu given; it outlives the filter.
  InformationFilter(const FusedState& state, const StateMatrix& covariance, const Rig& rig)
      : state_(state), form_(covariance), rig_(&rig) {}

  const FusedState& state() const { return state_; }
  StateMatrix Covariance() const { return form_.Covariance(); }
  BodyReading InBody(const ImuSample& reading) const {
    return strata::InBody(state_, *rig_->R_body_imu, reading);
  }

  // To `time_s` under `reading`; nothing where that is not later.
  void Predict(const ImuSample& reading, double time_s);

  using Innovation = InformationForm::Innovation;
  template <int rows>
  Innovation InnovationOf(const StateMeasurement<rows>& measurement) const {
    return form_.InnovationOf(measurement.H, measurement.residual, measurement.covariance);
  }

  template <int rows>
  void Add(const StateMeasurement<rows>& measurement) {
    form_.Add(measurement.H, measurement.residual, measurement.covariance);
    state_ = Retract(state_, form_.Correct());
  }

  // The position forgets what it knew.
  void Relocate(const Relocation& relocation);

 private:
  FusedState state_;
  InformationForm form_;
  const Rig* rig_;
};

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_INFORMATION_FILTER_H_
