// What IMU, wheels and GPS say of the nodes of a smoothed log, for Ceres to differentiate, which
// Make() does. Internal to core/egomotion, not installed.
//
// A node is two blocks: pose [quaternion x y z w of R_map_body, place of the IMU] and motion
// [velocity, gyroscope's bias, accelerometer's bias]; all nodes share [wheels' scale, yaw of the
// mount].
#ifndef STRATA_CORE_EGOMOTION_SMOOTHING_MOTION_COSTS_H_
#define STRATA_CORE_EGOMOTION_SMOOTHING_MOTION_COSTS_H_

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/cost_function.h>

#include "core/egomotion/inertial_motion.h"
#include "core/egomotion/smoothing/preintegration.h"

namespace strata {

inline constexpr int kPoseBlock = 7, kMotionBlock = 9, kSharedBlock = 2;

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

// A node's blocks by name.
template <typename T>
struct NodeView {
  NodeView(const T* pose, const T* motion)
      : R_map_body(Eigen::Map<const Eigen::Quaternion<T>>(pose)),
        p_imu(Eigen::Map<const Vector3<T>>(pose + 4)),
        v_imu(Eigen::Map<const Vector3<T>>(motion)),
        gyro_bias(Eigen::Map<const Vector3<T>>(motion + 3)),
        accelerometer_bias(Eigen::Map<const Vector3<T>>(motion + 6)) {}
  Eigen::Quaternion<T> R_map_body;
  Vector3<T> p_imu, v_imu, gyro_bias, accelerometer_bias;
};

// A small rotation's vector, to its third power.
template <typename T>
Vector3<T> SmallRotation(const Eigen::Quaternion<T>& q) {
  return (q.w() < T(0.0) ? T(-2.0) : T(2.0)) * q.vec();
}

template <typename T>
Eigen::Quaternion<T> SmallTurn(const Vector3<T>& rotation) {
  return Eigen::Quaternion<T>(
             T(1.0), T(0.5) * rotation.x(), T(0.5) * rotation.y(), T(0.5) * rotation.z())
      .normalized();
}

// R_map_imu.
template <typename T>
Eigen::Quaternion<T> ImuAxes(const Eigen::Quaternion<T>& R_map_body,
                             const T* shared,
                             const Eigen::Quaterniond& mount) {
  const T half = T(0.5) * shared[1];
  using std::cos;
  using std::sin;
  return R_map_body * Eigen::Quaternion<T>(cos(half), T(0.0), T(0.0), sin(half)) * mount.cast<T>();
}

// The relative motion for a node's own biases.
template <typename T>
struct CorrectedDelta {
  CorrectedDelta(const InertialDelta& delta, const NodeView<T>& node) {
    const Vector3<T> gyro = node.gyro_bias - delta.gyro_bias.cast<T>();
    const Vector3<T> accelerometer = node.accelerometer_bias - delta.accelerometer_bias.cast<T>();
    rotation = delta.rotation.cast<T>() *
               SmallTurn<T>(Vector3<T>(delta.rotation_by_gyro.cast<T>() * gyro));
    velocity = delta.velocity.cast<T>() + delta.velocity_by_gyro.cast<T>() * gyro +
               delta.velocity_by_accelerometer.cast<T>() * accelerometer;
    position = delta.position.cast<T>() + delta.position_by_gyro.cast<T>() * gyro +
               delta.position_by_accelerometer.cast<T>() * accelerometer;
  }
  Eigen::Quaternion<T> rotation;
  Vector3<T> velocity, position;
};

// Two nodes and the IMU between them.
class InertialCost {
 public:
  InertialCost(const InertialDelta& delta, const Eigen::Quaterniond& mount, const ImuModel& imu);

  static ceres::CostFunction* Make(const InertialDelta& delta,
                                   const Eigen::Quaterniond& mount,
                                   const ImuModel& imu);

  template <typename T>
  bool operator()(const T* pose_i,
                  const T* motion_i,
                  const T* pose_j,
                  const T* motion_j,
                  const T* shared,
                  T* residuals) const {
    const NodeView<T> i(pose_i, motion_i), j(pose_j, motion_j);
    const CorrectedDelta<T> delta(delta_, i);
    const Eigen::Quaternion<T> R_i = ImuAxes(i.R_map_body, shared, mount_);
    const Eigen::Quaternion<T> R_j = ImuAxes(j.R_map_body, shared, mount_);
    const T dt(delta_.duration_s);
    const Vector3<T> g(T(0.0), T(0.0), T(-kGravityM_s2));
    Eigen::Matrix<T, 9, 1> error;
    error << SmallRotation<T>(delta.rotation.conjugate() * R_i.conjugate() * R_j),
        R_i.conjugate() * (j.v_imu - i.v_imu - dt * g) - delta.velocity,
        R_i.conjugate() * (j.p_imu - i.p_imu - dt * i.v_imu - T(0.5) * dt * dt * g) -
            delta.position;
    Eigen::Map<Eigen::Matrix<T, 15, 1>> whitened(residuals);
    whitened.template head<9>() = root_.cast<T>() * error;
    whitened.template segment<3>(9) = (j.gyro_bias - i.gyro_bias) / T(gyro_walk_);
    whitened.template tail<3>() =
        (j.accelerometer_bias - i.accelerometer_bias) / T(accelerometer_walk_);
    return true;
  }

 private:
  const InertialDelta delta_;
  const Eigen::Quaterniond mount_;
  Eigen::Matrix<double, 9, 9> root_;  // of the information
  double gyro_walk_, accelerometer_walk_;
};

// What wheels say of the way between two nodes.
struct WheelDelta {
  Eigen::Vector3d way_m = Eigen::Vector3d::Zero();  // in the body's axes at the beginning
  double yaw_rad = 0.0;
  Eigen::Vector4d sigma = Eigen::Vector4d::Ones();  // of the way and the yaw
  bool has_yaw = false;
};

class WheelCost {
 public:
  WheelCost(const WheelDelta& delta, const Eigen::Vector3d& imu_body_m)
      : delta_(delta), imu_body_m_(imu_body_m) {}

  static ceres::CostFunction* Make(const WheelDelta& delta, const Eigen::Vector3d& imu_body_m);

  template <typename T>
  bool operator()(const T* pose_i, const T* pose_j, const T* shared, T* residuals) const {
    const Eigen::Map<const Eigen::Quaternion<T>> R_i(pose_i), R_j(pose_j);
    const Eigen::Map<const Vector3<T>> p_i(pose_i + 4), p_j(pose_j + 4);
    const Vector3<T> arm = imu_body_m_.cast<T>();
    const Eigen::Quaternion<T> turn = R_i.conjugate() * R_j;
    const Vector3<T> way = R_i.conjugate() * Vector3<T>(p_j - p_i) - turn * arm + arm;
    Eigen::Map<Eigen::Matrix<T, 4, 1>> whitened(residuals);
    whitened.template head<3>() = (T(1.0) + shared[0]) * way - delta_.way_m.cast<T>();
    using std::atan2;
    whitened(3) = delta_.has_yaw ? T(2.0) * atan2(turn.z(), turn.w()) - T(delta_.yaw_rad) : T(0.0);
    whitened.array() /= delta_.sigma.cast<T>().array();
    return true;
  }

 private:
  const WheelDelta delta_;
  const Eigen::Vector3d imu_body_m_;
};

// A fix some time after a node, by the IMU in between: its place on the ground (2), and its
// altitude (1), which is believed by itself.
struct FixDelta {
  InertialDelta delta;
  Eigen::Quaterniond mount = Eigen::Quaterniond::Identity();
  Eigen::Vector3d arm_m = Eigen::Vector3d::Zero();  // from the IMU to the antenna, in the body
  Eigen::Vector3d antenna_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Ones();
};

// (measured − predicted) / σ.
template <typename T>
Vector3<T> WhitenedFix(const FixDelta& fix, const T* pose, const T* motion, const T* shared) {
  const NodeView<T> node(pose, motion);
  const CorrectedDelta<T> delta(fix.delta, node);
  const Eigen::Quaternion<T> R = ImuAxes(node.R_map_body, shared, fix.mount);
  const T dt(fix.delta.duration_s);
  const Vector3<T> g(T(0.0), T(0.0), T(-kGravityM_s2));
  // The arm in the axes of the IMU.
  const Eigen::Quaternion<T> turned = ImuAxes(Eigen::Quaternion<T>::Identity(), shared, fix.mount);
  const Vector3<T> arm = turned.conjugate() * Vector3<T>(fix.arm_m.cast<T>());
  const Vector3<T> antenna = node.p_imu + dt * node.v_imu + T(0.5) * dt * dt * g +
                             R * Vector3<T>(delta.position + delta.rotation * arm);
  return (fix.antenna_m.cast<T>() - antenna).array() / fix.sigma_m.cast<T>().array();
}

// Rows `first` to `first` + `rows` of WhitenedFix().
template <int first, int rows>
class FixCost {
 public:
  explicit FixCost(const FixDelta& fix) : fix_(fix) {}

  static ceres::CostFunction* Make(const FixDelta& fix);

  template <typename T>
  bool operator()(const T* pose, const T* motion, const T* shared, T* residuals) const {
    Eigen::Map<Eigen::Matrix<T, rows, 1>> whitened(residuals);
    whitened = WhitenedFix(fix_, pose, motion, shared).template segment<rows>(first);
    return true;
  }

 private:
  const FixDelta fix_;
};
using PlaceCost = FixCost<0, 2>;
using AltitudeCost = FixCost<2, 1>;

// What is known of biases at the first node and of what all share.
class BiasPrior {
 public:
  BiasPrior(const Eigen::Matrix<double, 6, 1>& biases, const Eigen::Matrix<double, 6, 1>& sigma)
      : biases_(biases), sigma_(sigma) {}

  static ceres::CostFunction* Make(const Eigen::Matrix<double, 6, 1>& biases,
                                   const Eigen::Matrix<double, 6, 1>& sigma);

  template <typename T>
  bool operator()(const T* motion, T* residuals) const {
    for (int i = 0; i < 6; ++i) residuals[i] = (motion[3 + i] - T(biases_(i))) / T(sigma_(i));
    return true;
  }

 private:
  const Eigen::Matrix<double, 6, 1> biases_, sigma_;
};

class SharedPrior {
 public:
  explicit SharedPrior(const Eigen::Vector2d& sigma) : sigma_(sigma) {}

  static ceres::CostFunction* Make(const Eigen::Vector2d& sigma);

  template <typename T>
  bool operator()(const T* shared, T* residuals) const {
    for (int i = 0; i < 2; ++i) residuals[i] = shared[i] / T(sigma_(i));
    return true;
  }

 private:
  const Eigen::Vector2d sigma_;
};

}  // namespace strata

#endif  // STRATA_CORE_EGOMOTION_SMOOTHING_MOTION_COSTS_H_
