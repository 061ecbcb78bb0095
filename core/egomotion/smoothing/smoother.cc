#include "core/egomotion/smoothing/smoother.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <ceres/covariance.h>
#include <ceres/iteration_callback.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/product_manifold.h>
#include <ceres/solver.h>

#include "core/common/status.h"
#include "core/egomotion/fused_state.h"
#include "core/egomotion/gps_gate.h"
#include "core/egomotion/smoothing/log_nodes.h"
#include "core/egomotion/smoothing/motion_costs.h"
#include "core/egomotion/smoothing/preintegration.h"
#include "core/egomotion/trajectory.h"
#include "core/geometry/screw_motion.h"

namespace strata {
namespace {

// Biases are corrected to first order: deltas are made anew once.
constexpr int kRounds = 2;
constexpr int kMaxIterations = 50;
// Of Cauchy's loss, in σ of a fix: below it counts nearly in full.
constexpr double kFixScale = 2.0;

using PoseBlocks = std::vector<std::array<double, kPoseBlock>>;
using MotionBlocks = std::vector<std::array<double, kMotionBlock>>;

// What is estimated, by nodes.
struct Unknowns {
  PoseBlocks poses;
  MotionBlocks motions;
  std::array<double, kSharedBlock> shared = {0.0, 0.0};

  FusedState StateOf(std::size_t node, double time_s) const {
    const NodeView<double> view(poses[node].data(), motions[node].data());
    return {time_s,
            view.R_map_body,
            view.p_imu,
            view.v_imu,
            view.gyro_bias,
            view.accelerometer_bias,
            shared[0],
            shared[1]};
  }
};

// The filter's state that is nearest in time.
const FusedState& NearestState(const std::vector<FusedState>& states, double time_s) {
  const auto after = std::lower_bound(
      states.begin(), states.end(), time_s, [](const FusedState& state, double time) {
        return state.time_s < time;
      });
  if (after == states.begin()) return states.front();
  if (after == states.end()) return states.back();
  return time_s - (after - 1)->time_s < after->time_s - time_s ? *(after - 1) : *after;
}

class Aborter final : public ceres::IterationCallback {
 public:
  explicit Aborter(const Stop& stop) : stop_(stop) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& /*iteration*/) override {
    return stop_.status().ok() ? ceres::SOLVER_CONTINUE : ceres::SOLVER_ABORT;
  }

 private:
  const Stop& stop_;
};

class Smoother {
 public:
  Smoother(const MotionLog& log, const Rig& rig, const Egomotion& filtered);

  absl::Status Solve(const Stop& stop);
  absl::StatusOr<Egomotion> Result();

 private:
  using PoseManifold =
      ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;

  void Build();
  void AddNode(std::size_t node);
  void AddFixes();
  // The node before a time, if there is one and another after it.
  std::optional<std::size_t> NodeBefore(double time_s) const;
  InertialDelta DeltaFrom(std::size_t node, double until_s) const;
  FixDelta DeltaOf(const FixOutcome& fix, std::size_t node) const;
  absl::StatusOr<std::vector<Matrix6d>> BodyCovariances(ceres::Covariance& covariance) const;
  absl::Status Report(const ceres::Covariance& covariance, Egomotion& result) const;
  void JudgeFixes(Egomotion& result) const;
  // Poses between a node and the next, as many as the filter's.
  void Fill(std::size_t node,
            const std::vector<Matrix6d>& covariances,
            std::vector<TrajectoryPose>& poses,
            std::vector<FusedState>& states) const;

  const MotionLog& log_;
  const Rig& rig_;
  const Egomotion& filtered_;
  std::vector<WheelSample> wheels_;  // without lag
  std::vector<std::size_t> nodes_;   // samples of the IMU
  Unknowns unknowns_;
  std::vector<InertialDelta> deltas_;  // from each node to the next
  std::unique_ptr<PoseManifold> manifold_ = std::make_unique<PoseManifold>();
  std::unique_ptr<ceres::CauchyLoss> loss_ = std::make_unique<ceres::CauchyLoss>(kFixScale);
  std::unique_ptr<ceres::Problem> problem_;
};

Smoother::Smoother(const MotionLog& log, const Rig& rig, const Egomotion& filtered)
    : log_(log),
      rig_(rig),
      filtered_(filtered),
      wheels_(log.wheels),
      nodes_(NodesOf(log.imu, kNodeS)),
      deltas_(nodes_.size() - 1) {
  for (WheelSample& sample : wheels_) sample.time_s -= rig.wheels.lag_s;
  const FusedState& last = filtered.states.back();
  for (const std::size_t sample : nodes_) {
    const FusedState& state = NearestState(filtered.states, log.imu[sample].time_s);
    const Eigen::Quaterniond& q = state.R_map_body;
    const Eigen::Vector3d &p = state.p_imu_m, &v = state.v_imu_m_s;
    unknowns_.poses.push_back({q.x(), q.y(), q.z(), q.w(), p.x(), p.y(), p.z()});
    auto& motion = unknowns_.motions.emplace_back();
    Eigen::Map<Eigen::Matrix<double, kMotionBlock, 1>>(motion.data()) << v, last.gyro_bias_rad_s,
        last.accelerometer_bias_m_s2;
  }
  unknowns_.shared = {last.wheel_scale, last.yaw_mount_rad};
}

InertialDelta Smoother::DeltaFrom(std::size_t node, double until_s) const {
  const NodeView<double> view(unknowns_.poses[node].data(), unknowns_.motions[node].data());
  InertialDelta start;
  start.gyro_bias = view.gyro_bias;
  start.accelerometer_bias = view.accelerometer_bias;
  return DeltaBetween(log_.imu, rig_.imu, nodes_[node], until_s, start);
}

void Smoother::AddNode(std::size_t node) {
  const Eigen::Quaterniond& mount = filtered_.R_body_imu;
  double* const pose = unknowns_.poses[node].data();
  double* const motion = unknowns_.motions[node].data();
  problem_->AddParameterBlock(pose, kPoseBlock, manifold_.get());
  problem_->AddParameterBlock(motion, kMotionBlock);
  if (node == 0) return;
  double* const pose_before = unknowns_.poses[node - 1].data();
  double* const motion_before = unknowns_.motions[node - 1].data();
  deltas_[node - 1] = DeltaFrom(node - 1, log_.imu[nodes_[node]].time_s);
  problem_->AddResidualBlock(InertialCost::Make(deltas_[node - 1], mount, rig_.imu),
                             nullptr,
                             pose_before,
                             motion_before,
                             pose,
                             motion,
                             unknowns_.shared.data());
  const Eigen::Quaterniond turned =
      Eigen::AngleAxisd(unknowns_.shared[1], Eigen::Vector3d::UnitZ()) * mount;
  const std::optional<WheelDelta> wheels = WheelsBetween(log_.imu,
                                                         wheels_,
                                                         rig_.wheels,
                                                         turned,
                                                         deltas_[node - 1].gyro_bias,
                                                         nodes_[node - 1],
                                                         nodes_[node]);
  if (!wheels.has_value()) return;
  problem_->AddResidualBlock(WheelCost::Make(*wheels, rig_.imu_body_m),
                             nullptr,
                             pose_before,
                             pose,
                             unknowns_.shared.data());
}

std::optional<std::size_t> Smoother::NodeBefore(double time_s) const {
  const auto after = std::upper_bound(
      nodes_.begin(), nodes_.end(), time_s, [this](double time, std::size_t sample) {
        return time < log_.imu[sample].time_s;
      });
  if (after == nodes_.begin() || after == nodes_.end()) return std::nullopt;
  return static_cast<std::size_t>(after - nodes_.begin()) - 1;
}

FixDelta Smoother::DeltaOf(const FixOutcome& fix, std::size_t node) const {
  return {DeltaFrom(node, fix.time_s),
          filtered_.R_body_imu,
          rig_.gps.antenna_body_m - rig_.imu_body_m,
          fix.antenna_m,
          fix.sigma_m};
}

void Smoother::AddFixes() {
  for (const FixOutcome& fix : filtered_.fixes) {
    const std::optional<std::size_t> node = NodeBefore(fix.time_s);
    if (!node.has_value()) continue;
    const FixDelta delta = DeltaOf(fix, *node);
    for (ceres::CostFunction* const cost : {PlaceCost::Make(delta), AltitudeCost::Make(delta)}) {
      problem_->AddResidualBlock(cost,
                                 loss_.get(),
                                 unknowns_.poses[*node].data(),
                                 unknowns_.motions[*node].data(),
                                 unknowns_.shared.data());
    }
  }
}

void Smoother::Build() {
  ceres::Problem::Options options;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_ = std::make_unique<ceres::Problem>(options);
  problem_->AddParameterBlock(unknowns_.shared.data(), kSharedBlock);
  for (std::size_t node = 0; node < nodes_.size(); ++node) AddNode(node);
  AddFixes();
  const double gyro_sigma = rig_.imu.gyro_bias_rad_s;
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(gyro_sigma),
      Eigen::Vector3d::Constant(rig_.imu.accelerometer_bias_m_s2);
  problem_->AddResidualBlock(
      BiasPrior::Make(Vector6d::Zero(), sigma), nullptr, unknowns_.motions.front().data());
  problem_->AddResidualBlock(
      SharedPrior::Make({rig_.wheels.scale, rig_.yaw_mount_rad}), nullptr, unknowns_.shared.data());
}

absl::Status Smoother::Solve(const Stop& stop) {
  for (int round = 0; round < kRounds; ++round) {
    Build();
    Aborter aborter(stop);
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    options.max_num_iterations = kMaxIterations;
    options.callbacks = {&aborter};
    ceres::Solver::Summary summary;
    ceres::Solve(options, problem_.get(), &summary);
    STRATA_RETURN_IF_ERROR(stop.status());
    if (!summary.IsSolutionUsable()) {
      return absl::InternalError(absl::StrCat("smoothing failed: ", summary.message));
    }
  }
  return absl::OkStatus();
}

// Ceres turns quaternions on the left, by twice the step's length.
absl::StatusOr<std::vector<Matrix6d>> Smoother::BodyCovariances(
    ceres::Covariance& covariance) const {
  std::vector<std::pair<const double*, const double*>> blocks;
  for (const auto& pose : unknowns_.poses) blocks.emplace_back(pose.data(), pose.data());
  const double* const motion = unknowns_.motions.back().data();
  blocks.emplace_back(motion, motion);
  blocks.emplace_back(unknowns_.shared.data(), unknowns_.shared.data());
  if (!covariance.Compute(blocks, problem_.get())) {
    return absl::InternalError(
        "smoothing: the covariance cannot be computed; the log does not determine the poses");
  }
  std::vector<Matrix6d> result;
  for (std::size_t node = 0; node < nodes_.size(); ++node) {
    const double* const pose = unknowns_.poses[node].data();
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> steps;
    covariance.GetCovarianceBlockInTangentSpace(pose, pose, steps.data());
    const FusedState state = unknowns_.StateOf(node, 0.0);
    StateMatrix errors = StateMatrix::Zero();
    Matrix6d J = Matrix6d::Identity();
    J.topLeftCorner<3, 3>() = 2.0 * state.R_map_body.toRotationMatrix().transpose();
    errors.topLeftCorner<6, 6>() = J * steps * J.transpose();
    result.push_back(BodyCovariance(state, errors, rig_.imu_body_m));
  }
  return result;
}

void Smoother::Fill(std::size_t node,
                    const std::vector<Matrix6d>& covariances,
                    std::vector<TrajectoryPose>& poses,
                    std::vector<FusedState>& states) const {
  const double begin_s = log_.imu[nodes_[node]].time_s;
  const double end_s = log_.imu[nodes_[node + 1]].time_s;
  const FusedState first = unknowns_.StateOf(node, begin_s);
  const FusedState last = unknowns_.StateOf(node + 1, end_s);
  const auto moved = [&](double time_s) {
    const NodeView<double> view(unknowns_.poses[node].data(), unknowns_.motions[node].data());
    const InertialDelta delta = DeltaFrom(node, time_s);
    const double dt = delta.duration_s;
    const Eigen::Quaterniond mount =
        Eigen::AngleAxisd(first.yaw_mount_rad, Eigen::Vector3d::UnitZ()) * filtered_.R_body_imu;
    const Eigen::Quaterniond R = view.R_map_body * mount;
    const Eigen::Vector3d g = -kGravityM_s2 * Eigen::Vector3d::UnitZ();
    FusedState state = first;
    state.time_s = time_s;
    state.R_map_body = (R * delta.rotation * mount.conjugate()).normalized();
    state.v_imu_m_s += dt * g + R * delta.velocity;
    state.p_imu_m += dt * view.v_imu + 0.5 * dt * dt * g + R * delta.position;
    return state;
  };
  // The IMU does not quite come to the next node: what is left is spread over the way.
  const StateVector left = Difference(moved(end_s), last);
  for (const FusedState& at : filtered_.states) {
    if (at.time_s < begin_s || at.time_s >= end_s) continue;
    const double share = (at.time_s - begin_s) / (end_s - begin_s);
    const FusedState state = Retract(moved(at.time_s), share * left);
    poses.push_back({at.time_s,
                     BodyPose(state, rig_.imu_body_m),
                     (1.0 - share) * covariances[node] + share * covariances[node + 1]});
    states.push_back(state);
  }
}

void Smoother::JudgeFixes(Egomotion& result) const {
  EgomotionReport& report = result.report;
  report.used = report.rejected = 0;
  double squares = 0.0, nis = 0.0;
  for (FixOutcome& fix : result.fixes) {
    const std::optional<std::size_t> node = NodeBefore(fix.time_s);
    if (!node.has_value()) continue;
    const Eigen::Vector3d whitened = WhitenedFix(DeltaOf(fix, *node),
                                                 unknowns_.poses[*node].data(),
                                                 unknowns_.motions[*node].data(),
                                                 unknowns_.shared.data());
    fix.innovation_m = whitened.cwiseProduct(fix.sigma_m);
    fix.horizontal_nis = whitened.head<2>().squaredNorm();
    fix.used = fix.horizontal_nis <= kGpsGateNis;
    ++(fix.used ? report.used : report.rejected);
    if (!fix.used) continue;
    squares += fix.innovation_m.head<2>().squaredNorm();
    nis += fix.horizontal_nis;
  }
  const double used = std::max<double>(1.0, static_cast<double>(report.used));
  report.innovation_rms_m = std::sqrt(squares / used);
  report.mean_nis = nis / used;
}

absl::Status Smoother::Report(const ceres::Covariance& covariance, Egomotion& result) const {
  const double* const motion = unknowns_.motions.back().data();
  Eigen::Matrix<double, kMotionBlock, kMotionBlock, Eigen::RowMajor> motions;
  Eigen::Matrix<double, kSharedBlock, kSharedBlock, Eigen::RowMajor> shared;
  if (!covariance.GetCovarianceBlock(motion, motion, motions.data()) ||
      !covariance.GetCovarianceBlock(
          unknowns_.shared.data(), unknowns_.shared.data(), shared.data())) {
    return absl::InternalError("smoothing: a covariance is missing");
  }
  EgomotionReport& report = result.report;
  report.last = result.states.back();
  report.last_sigma << result.trajectory.poses().back().covariance.diagonal(), motions.diagonal(),
      shared.diagonal();
  report.last_sigma = report.last_sigma.cwiseSqrt();
  const Eigen::Matrix3d R = result.trajectory.poses().front().T_map_body.linear();
  report.heading_at_start_rad = std::atan2(R(1, 0), R(0, 0));
  report.distance_m = 0.0;
  for (std::size_t i = 1; i < result.states.size(); ++i) {
    report.distance_m += (result.states[i].p_imu_m - result.states[i - 1].p_imu_m).norm();
  }
  return absl::OkStatus();
}

absl::StatusOr<Egomotion> Smoother::Result() {
  ceres::Covariance::Options options;
  options.num_threads = 1;
  ceres::Covariance covariance(options);
  STRATA_ASSIGN_OR_RETURN(const std::vector<Matrix6d> covariances, BodyCovariances(covariance));
  std::vector<TrajectoryPose> poses;
  std::vector<FusedState> states;
  for (std::size_t node = 0; node + 1 < nodes_.size(); ++node) {
    Fill(node, covariances, poses, states);
  }
  const double end_s = log_.imu.back().time_s;
  states.push_back(unknowns_.StateOf(nodes_.size() - 1, end_s));
  poses.push_back({end_s, BodyPose(states.back(), rig_.imu_body_m), covariances.back()});
  STRATA_ASSIGN_OR_RETURN(Trajectory trajectory, Trajectory::Make(std::move(poses)));
  Egomotion result{filtered_.origin,
                   filtered_.R_body_imu,
                   std::move(trajectory),
                   std::move(states),
                   filtered_.fixes,
                   filtered_.report};
  JudgeFixes(result);
  STRATA_RETURN_IF_ERROR(Report(covariance, result));
  return result;
}

}  // namespace

absl::StatusOr<Egomotion> SmoothLog(const MotionLog& log,
                                    const Rig& rig,
                                    const Egomotion& filtered,
                                    const Stop& stop) {
  Smoother smoother(log, rig, filtered);
  STRATA_RETURN_IF_ERROR(smoother.Solve(stop));
  return smoother.Result();
}

}  // namespace strata
