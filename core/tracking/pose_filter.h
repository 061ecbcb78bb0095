// A pose and how well it is known, moved by odometry and corrected by what was measured of it: an
// information filter (thesis 10.2.1) over SE(3), whose errors are right-hand steps.
#ifndef STRATA_CORE_TRACKING_POSE_FILTER_H_
#define STRATA_CORE_TRACKING_POSE_FILTER_H_

#include "core/egomotion/information_form.h"
#include "core/geometry/pose.h"

namespace strata {

// What odometry errs over a motion, where nobody says better: 2 cm and 0.3° and what grows with the
// way (5 %, 0.3° a metre) and the turn (2 %), along every axis alike.
Matrix6d MotionCovariance(const Pose& motion);

class PoseFilter {
 public:
  // REQUIRES: positive definite, as of every covariance here.
  PoseFilter(const Pose& T, const Matrix6d& covariance) : T_(T), form_(covariance) {}

  const Pose& pose() const { return T_; }
  Matrix6d Covariance() const { return form_.Covariance(); }

  // T ← T · motion, `covariance` of a right-hand step on the motion.
  void Predict(const Pose& motion, const Matrix6d& covariance);
  // Into other coordinates; what is known stays.
  void Move(const Pose& T_new_old) { T_ = Normalized(T_new_old * T_); }

  // νᵀ S⁻¹ ν of a pose measured with `information`, over the directions that it knows anything of:
  // χ² with as many degrees of freedom, at most 6, where both are right.
  double InnovationOf(const Pose& measured, const Matrix6d& information) const;
  // Corrects by it, along those directions.
  void Update(const Pose& measured, const Matrix6d& information);

 private:
  Pose T_;
  InformationForm form_;
};

}  // namespace strata

#endif  // STRATA_CORE_TRACKING_POSE_FILTER_H_
