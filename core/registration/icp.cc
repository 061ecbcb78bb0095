#include "core/registration/icp.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>

#include "core/common/option_checks.h"
#include "core/common/random.h"
#include "core/common/status.h"
#include "core/registration/extrapolation.h"
#include "core/registration/point_index.h"
#include "core/registration/umeyama.h"

namespace strata {
namespace {

struct IcpPair {
  std::size_t source = 0;
  std::size_t target = 0;
  double distance_m = 0.0;
  double weight = 1.0;
};

// Solution of one iteration.
struct IcpStep {
  NormalStep solution;
  Matrix6d information = Matrix6d::Zero();
  double mean_squared_error_before = 0.0;
  double mean_squared_error_after = 0.0;
};

// Finite points relative to `centre`.
std::vector<Eigen::Vector3d> FinitePoints(const PointCloud& cloud, const Eigen::Vector3d& centre) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(cloud.size());
  for (const Eigen::Vector3f& p : cloud.points) {
    if (p.allFinite()) points.emplace_back(p.cast<double>() + (cloud.origin - centre));
  }
  return points;
}

std::vector<Eigen::Vector3d> Select(std::vector<Eigen::Vector3d> points,
                                    const IcpOptions& options) {
  const auto count = static_cast<std::size_t>(options.max_points);
  if (options.selection == IcpSelection::kAll || points.size() <= count) return points;
  std::vector<Eigen::Vector3d> selected;
  if (options.selection == IcpSelection::kEveryNth) {
    for (std::size_t i = 0; i < count; ++i) selected.push_back(points[i * points.size() / count]);
    return selected;
  }
  SplitMix64 random(options.seed);
  for (const std::uint32_t i : SampleIndices(
           static_cast<std::uint32_t>(points.size()), static_cast<std::uint32_t>(count), random)) {
    selected.push_back(points[i]);
  }
  return selected;
}

// One registration; all coordinates relative to the clouds' own origins.
class Icp {
 public:
  Icp(const PointCloud& source, const PointCloud& target, const IcpOptions& options);

  RegistrationResult Run(const Pose& T_guess);

 private:
  std::vector<IcpPair> Match(const Pose& T) const;
  void KeepMutual(const Pose& T, std::vector<IcpPair>& pairs) const;
  void Trim(std::vector<IcpPair>& pairs) const;
  void Weigh(const Pose& T, std::vector<IcpPair>& pairs) const;
  IcpStep PointToPointStep(const Pose& T, const std::vector<IcpPair>& pairs) const;
  IcpStep PointToPlaneStep(const Pose& T, const std::vector<IcpPair>& pairs) const;
  bool WithinBounds(const Pose& T, const Pose& T_guess) const;

  const IcpOptions& options_;
  std::vector<Eigen::Vector3d> source_;  // selected
  std::vector<Eigen::Vector3d> target_;
  std::vector<Eigen::Vector3d> source_normals_;  // where a choice needs them
  std::vector<Eigen::Vector3d> target_normals_;
  std::unique_ptr<PointIndex> target_index_;
  std::unique_ptr<PointIndex> source_index_;  // for mutual pairs
  double radius_m_ = 1.0;
};

Icp::Icp(const PointCloud& source, const PointCloud& target, const IcpOptions& options)
    : options_(options),
      source_(Select(FinitePoints(source, source.origin), options)),
      target_(FinitePoints(target, target.origin)) {
  const bool compares_normals = options.weighting == IcpWeighting::kNormalCompatibility ||
                                options.max_normal_angle_rad < 0.5 * std::numbers::pi;
  if (compares_normals) source_normals_ = EstimateNormals(source_, options.normal_neighbours);
  if (compares_normals || options.metric == IcpMetric::kPointToPlane) {
    target_normals_ = EstimateNormals(target_, options.normal_neighbours);
  }
  target_index_ =
      options.matching == IcpMatching::kClosestPoint
          ? MakeClosestPointIndex(target_)
          : MakeProjectionIndex(
                target_, target.sensor_origin.cast<double>(), options.projection_cell_rad);
  if (options.mutual) source_index_ = MakeClosestPointIndex(source_);
  double squared = 0.0;
  for (const Eigen::Vector3d& p : source_) squared += p.squaredNorm();
  if (!source_.empty()) radius_m_ = std::sqrt(squared / static_cast<double>(source_.size()));
}

std::vector<IcpPair> Icp::Match(const Pose& T) const {
  std::vector<IcpPair> pairs;
  const double min_cosine = std::cos(options_.max_normal_angle_rad);
  for (std::size_t i = 0; i < source_.size(); ++i) {
    const Eigen::Vector3d p = T * source_[i];
    const std::size_t j = target_index_->Find(p, options_.max_distance_m);
    if (j == PointIndex::kNone) continue;
    if (!source_normals_.empty() &&
        std::abs((T.linear() * source_normals_[i]).dot(target_normals_[j])) < min_cosine - 1e-12) {
      continue;
    }
    pairs.push_back({i, j, (p - target_[j]).norm(), 1.0});
  }
  if (options_.mutual) KeepMutual(T, pairs);
  if (options_.keep_share < 1.0) Trim(pairs);
  Weigh(T, pairs);
  return pairs;
}

void Icp::KeepMutual(const Pose& T, std::vector<IcpPair>& pairs) const {
  const Pose T_source_target = T.inverse();
  std::erase_if(pairs, [&](const IcpPair& pair) {
    const std::size_t back =
        source_index_->Find(T_source_target * target_[pair.target], 2.0 * options_.max_distance_m);
    return back != pair.source;
  });
}

void Icp::Trim(std::vector<IcpPair>& pairs) const {
  std::stable_sort(pairs.begin(), pairs.end(), [](const IcpPair& a, const IcpPair& b) {
    return a.distance_m < b.distance_m;
  });
  pairs.resize(
      static_cast<std::size_t>(std::ceil(options_.keep_share * static_cast<double>(pairs.size()))));
}

void Icp::Weigh(const Pose& T, std::vector<IcpPair>& pairs) const {
  if (options_.weighting == IcpWeighting::kUniform) return;
  for (IcpPair& pair : pairs) {
    pair.weight =
        options_.weighting == IcpWeighting::kDistance
            ? 1.0 - pair.distance_m / options_.max_distance_m
            : std::abs(
                  (T.linear() * source_normals_[pair.source]).dot(target_normals_[pair.target]));
  }
}

IcpStep Icp::PointToPointStep(const Pose& T, const std::vector<IcpPair>& pairs) const {
  std::vector<Eigen::Vector3d> x;
  std::vector<Eigen::Vector3d> y;
  std::vector<double> weights;
  const Pose T_source_target = T.inverse();
  IcpStep step;
  double total = 0.0;
  for (const IcpPair& pair : pairs) {
    x.push_back(source_[pair.source]);
    y.push_back(T_source_target * target_[pair.target]);
    weights.push_back(pair.weight);
    total += pair.weight;
    step.mean_squared_error_before += pair.weight * pair.distance_m * pair.distance_m;
  }
  step.mean_squared_error_before /= std::max(total, 1e-300);
  const UmeyamaResult fit = FitRigidTransform(x, y, weights);
  step.solution.step << So3Log(fit.T_y_x.linear()), fit.T_y_x.translation();
  step.solution.degenerate_directions = fit.degenerate_directions;
  step.mean_squared_error_after = fit.rms_m * fit.rms_m;
  step.information = PointInformation(x, std::max(fit.rms_m, 1e-3));
  return step;
}

IcpStep Icp::PointToPlaneStep(const Pose& T, const std::vector<IcpPair>& pairs) const {
  Matrix6d H = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  double error = 0.0;
  double total = 0.0;
  for (const IcpPair& pair : pairs) {
    const Eigen::Vector3d& p = source_[pair.source];
    // The plane in the source frame; a right-hand step moves p by ω × p + v.
    const Eigen::Vector3d n = T.linear().transpose() * target_normals_[pair.target];
    const double r = target_normals_[pair.target].dot(target_[pair.target] - T * p);
    Vector6d J;
    J << p.cross(n), n;
    H.noalias() += pair.weight * J * J.transpose();
    b += pair.weight * r * J;
    error += pair.weight * r * r;
    total += pair.weight;
  }
  total = std::max(total, 1e-300);
  IcpStep step;
  step.solution = SolveNormalEquations(H, b, radius_m_, options_.min_eigenvalue_ratio);
  step.mean_squared_error_before = error / total;
  // At the minimum of the quadratic model.
  step.mean_squared_error_after = std::max(0.0, error - b.dot(step.solution.step)) / total;
  step.information = H / std::max(step.mean_squared_error_after, 1e-6);
  return step;
}

bool Icp::WithinBounds(const Pose& T, const Pose& T_guess) const {
  if (!T.matrix().allFinite()) return false;
  const Pose moved = T_guess.inverse() * T;
  return moved.translation().norm() <= options_.max_translation_m &&
         RotationAngleRad(moved) <= options_.max_rotation_rad;
}

RegistrationResult Icp::Run(const Pose& T_guess) {
  RegistrationResult result;
  result.T_target_source = T_guess;
  Pose T = T_guess;
  StepExtrapolator extrapolator(options_.extrapolation == IcpExtrapolation::kQuadratic,
                                options_.max_extrapolation,
                                radius_m_);
  for (result.iterations = 1;; ++result.iterations) {
    const std::vector<IcpPair> pairs = Match(T);
    result.inliers = static_cast<int>(pairs.size());
    result.overlap = source_.empty()
                         ? 0.0
                         : static_cast<double>(pairs.size()) / static_cast<double>(source_.size());
    if (pairs.size() < 3 || result.overlap < options_.min_overlap) {
      result.termination = Termination::kTooLittleOverlap;
      result.T_target_source = T_guess;
      return result;
    }
    const IcpStep step = options_.metric == IcpMetric::kPointToPoint ? PointToPointStep(T, pairs)
                                                                     : PointToPlaneStep(T, pairs);
    result.rms_m = std::sqrt(step.mean_squared_error_before);
    result.information = step.information;
    result.degenerate_directions = step.solution.degenerate_directions;
    T = Retract(T, step.solution.step);
    const bool still = step.solution.step.head<3>().norm() < options_.rotation_tolerance_rad &&
                       step.solution.step.tail<3>().norm() < options_.translation_tolerance_m;
    if (!still && options_.extrapolation != IcpExtrapolation::kNone) {
      T = Retract(T, extrapolator.Extend(step.solution.step, step.mean_squared_error_after));
    }
    if (!WithinBounds(T, T_guess)) {
      result.termination = Termination::kDiverged;
      result.T_target_source = T_guess;
      return result;
    }
    T = Normalized(T);
    result.T_target_source = T;
    if (still || result.iterations == options_.max_iterations) {
      result.termination = !result.degenerate_directions.empty() ? Termination::kDegenerate
                           : still                               ? Termination::kConverged
                                                                 : Termination::kMaxIterations;
      return result;
    }
  }
}

}  // namespace

absl::Status IcpOptions::Validate() const {
  OptionChecks checks("icp options");
  checks.InRange("max_points", max_points, 3, 1e8);
  checks.InRange("projection_cell_rad", projection_cell_rad, 0.001, 0.5);
  checks.InRange("max_extrapolation", max_extrapolation, 0.0, 100.0);
  checks.InRange("max_distance_m", max_distance_m, 1e-6, 1e4);
  checks.InRange("keep_share", keep_share, 1e-6, 1.0);
  checks.InRange("max_normal_angle_rad", max_normal_angle_rad, 1e-3, 0.5 * std::numbers::pi);
  checks.InRange("normal_neighbours", normal_neighbours, 3, 64);
  checks.InRange("max_iterations", max_iterations, 1, 10000);
  checks.InRange("rotation_tolerance_rad", rotation_tolerance_rad, 0.0, 1.0);
  checks.InRange("translation_tolerance_m", translation_tolerance_m, 0.0, 10.0);
  checks.InRange("min_overlap", min_overlap, 0.0, 1.0);
  checks.InRange("max_translation_m", max_translation_m, 0.0, 1e6);
  checks.InRange("max_rotation_rad", max_rotation_rad, 0.0, 3.15);
  checks.InRange("min_eigenvalue_ratio", min_eigenvalue_ratio, 0.0, 1.0);
  return checks.status();
}

absl::StatusOr<RegistrationResult> RegisterClouds(const PointCloud& source,
                                                  const PointCloud& target,
                                                  const Pose& T_target_source_guess,
                                                  const IcpOptions& options) {
  STRATA_RETURN_IF_ERROR(options.Validate());
  STRATA_RETURN_IF_ERROR(Annotate(ValidatePose(T_target_source_guess), "guess"));
  // Near zero on both sides: the origins go into the pose and out again.
  const Pose origin_source(Eigen::Translation3d(source.origin));
  const Pose origin_target(Eigen::Translation3d(target.origin));
  Icp icp(source, target, options);
  RegistrationResult result =
      icp.Run(origin_target.inverse() * T_target_source_guess * origin_source);
  result.T_target_source = origin_target * result.T_target_source * origin_source.inverse();
  return result;
}

}  // namespace strata
