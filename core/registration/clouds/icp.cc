#include "core/registration/clouds/icp.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include <Eigen/Core>
#include <pcl/common/transforms.h>
#include <pcl/correspondence.h>
#include <pcl/features/impl/normal_3d.hpp>
#include <pcl/features/normal_3d.h>
#include <pcl/memory.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/correspondence_estimation.h>
#include <pcl/registration/gicp.h>

#include "core/common/option_checks.h"
#include "core/common/random.h"
#include "core/common/status.h"
#include "core/registration/clouds/extrapolation.h"
#include "core/registration/clouds/projection_image.h"
#include "core/registration/umeyama.h"

namespace strata {
namespace {

using Point = pcl::PointNormal;
using Cloud = pcl::PointCloud<Point>;

// Solution of one iteration.
struct IcpStep {
  NormalStep solution;
  Matrix6d information = Matrix6d::Zero();
  double mean_squared_error_before = 0.0;
  double mean_squared_error_after = 0.0;
};

class Gicp : public pcl::GeneralizedIterativeClosestPoint<Point, Point> {
 public:
  int iterations() const { return nr_iterations_; }
};

Eigen::Vector3d PointOf(const Point& p) { return p.getVector3fMap().cast<double>(); }
Eigen::Vector3d NormalOf(const Point& p) { return p.getNormalVector3fMap().cast<double>(); }

// Finite points, relative to the cloud's origin.
Cloud::Ptr FinitePoints(const PointCloud& cloud) {
  auto points = pcl::make_shared<Cloud>();
  for (const Eigen::Vector3f& p : cloud.points) {
    if (p.allFinite()) points->emplace_back(p.x(), p.y(), p.z());
  }
  return points;
}

Cloud::Ptr Select(const Cloud::Ptr& points, const IcpOptions& options) {
  const auto count = static_cast<std::uint32_t>(options.max_points);
  const auto size = static_cast<std::uint32_t>(points->size());
  if (options.selection == IcpSelection::kAll || size <= count) return points;
  auto selected = pcl::make_shared<Cloud>();
  if (options.selection == IcpSelection::kEveryNth) {
    for (std::size_t i = 0; i < count; ++i) selected->push_back((*points)[i * size / count]);
    return selected;
  }
  SplitMix64 random(options.seed);
  for (const std::uint32_t i : SampleIndices(size, count, random)) {
    selected->push_back((*points)[i]);
  }
  return selected;
}

// Unit normals towards `sensor`; not finite where neighbours are too few.
void AddNormals(const Cloud::Ptr& points, const Eigen::Vector3f& sensor, int neighbours) {
  pcl::NormalEstimation<Point, Point> estimation;
  estimation.setInputCloud(points);
  estimation.setKSearch(std::min(neighbours, static_cast<int>(points->size())));
  estimation.setViewPoint(sensor.x(), sensor.y(), sensor.z());
  estimation.compute(*points);
}

// One registration; all coordinates relative to the clouds' own origins.
class Icp {
 public:
  Icp(const PointCloud& source, const PointCloud& target, const IcpOptions& options);

  RegistrationResult Run(const Pose& T_guess);

 private:
  pcl::Correspondences Match(const Pose& T);
  // Takes out pairs whose normals differ by more than is let, and then the farthest.
  void Reject(pcl::Correspondences& pairs) const;
  pcl::Correspondences Project() const;
  double WeightOf(const pcl::Correspondence& pair) const;
  // Counts the pairs; false, with the guess as the answer, if they are too few.
  bool Overlaps(const pcl::Correspondences& pairs,
                const Pose& T_guess,
                RegistrationResult& result) const;
  IcpStep StepOf(const Pose& T, const pcl::Correspondences& pairs) const;
  IcpStep PointToPointStep(const Pose& T, const pcl::Correspondences& pairs) const;
  IcpStep PointToPlaneStep(const Pose& T, const pcl::Correspondences& pairs) const;
  RegistrationResult RunGeneralised(const Pose& T_guess);
  bool WithinBounds(const Pose& T, const Pose& T_guess) const;

  const IcpOptions& options_;
  bool compares_normals_ = false;
  Cloud::Ptr source_;  // selected
  Cloud::Ptr target_;
  Cloud::Ptr moved_ = pcl::make_shared<Cloud>();  // the source where it was matched
  std::vector<Eigen::Vector3d> target_points_;    // of the image
  std::optional<ProjectionImage> image_;
  pcl::registration::CorrespondenceEstimation<Point, Point> closest_;
  double radius_m_ = 1.0;
};

Icp::Icp(const PointCloud& source, const PointCloud& target, const IcpOptions& options)
    : options_(options),
      compares_normals_(options.weighting == IcpWeighting::kNormalCompatibility ||
                        options.max_normal_angle_rad < std::numbers::pi),
      source_(Select(FinitePoints(source), options)),
      target_(FinitePoints(target)) {
  if (source_->empty() || target_->empty()) return;
  if (compares_normals_) AddNormals(source_, source.sensor_origin, options.normal_neighbours);
  if (compares_normals_ || options.metric != IcpMetric::kPointToPoint) {
    AddNormals(target_, target.sensor_origin, options.normal_neighbours);
  }
  if (options.matching == IcpMatching::kClosestPoint) {
    closest_.setInputTarget(target_);
  } else {
    for (const Point& p : *target_) target_points_.push_back(PointOf(p));
    image_.emplace(
        target_points_, target.sensor_origin.cast<double>(), options.projection_cell_rad);
  }
  double squared = 0.0;
  for (const Point& p : *source_) squared += PointOf(p).squaredNorm();
  radius_m_ = std::sqrt(squared / static_cast<double>(source_->size()));
}

pcl::Correspondences Icp::Match(const Pose& T) {
  pcl::Correspondences pairs;
  if (source_->empty() || target_->empty()) return pairs;
  pcl::transformPointCloudWithNormals(*source_, *moved_, T.matrix());
  if (image_.has_value()) {
    pairs = Project();
  } else {
    closest_.setInputSource(moved_);
    if (options_.mutual) {
      closest_.determineReciprocalCorrespondences(pairs, options_.max_distance_m);
    } else {
      closest_.determineCorrespondences(pairs, options_.max_distance_m);
    }
  }
  Reject(pairs);
  return pairs;
}

void Icp::Reject(pcl::Correspondences& pairs) const {
  if (options_.max_normal_angle_rad < std::numbers::pi) {
    const double least = std::cos(options_.max_normal_angle_rad);
    std::erase_if(pairs, [&](const pcl::Correspondence& pair) {
      const auto normal = (*moved_)[pair.index_query].getNormalVector3fMap();
      return !(normal.dot((*target_)[pair.index_match].getNormalVector3fMap()) > least);
    });
  }
  if (options_.keep_share >= 1.0) return;
  const auto kept = static_cast<std::ptrdiff_t>(
      std::floor(static_cast<float>(options_.keep_share) * static_cast<float>(pairs.size())));
  std::nth_element(
      pairs.begin(), pairs.begin() + kept, pairs.end(), [](const auto& a, const auto& b) {
        return a.distance < b.distance;
      });
  pairs.erase(pairs.begin() + kept, pairs.end());
}

pcl::Correspondences Icp::Project() const {
  pcl::Correspondences pairs;
  for (std::size_t i = 0; i < moved_->size(); ++i) {
    const Eigen::Vector3d p = PointOf((*moved_)[i]);
    const std::size_t j = image_->Find(p, options_.max_distance_m);
    if (j == ProjectionImage::kNone) continue;
    pairs.emplace_back(static_cast<int>(i),
                       static_cast<int>(j),
                       static_cast<float>((p - target_points_[j]).squaredNorm()));
  }
  return pairs;
}

// 0: a normal that is needed is not there.
double Icp::WeightOf(const pcl::Correspondence& pair) const {
  const Eigen::Vector3d n_target = NormalOf((*target_)[pair.index_match]);
  if (options_.metric != IcpMetric::kPointToPoint && !n_target.allFinite()) return 0.0;
  if (options_.weighting == IcpWeighting::kUniform) return 1.0;
  if (options_.weighting == IcpWeighting::kDistance) {
    return std::max(0.0, 1.0 - std::sqrt(pair.distance) / options_.max_distance_m);
  }
  const double cosine = std::abs(NormalOf((*moved_)[pair.index_query]).dot(n_target));
  return std::isfinite(cosine) ? cosine : 0.0;
}

IcpStep Icp::StepOf(const Pose& T, const pcl::Correspondences& pairs) const {
  return options_.metric == IcpMetric::kPointToPoint ? PointToPointStep(T, pairs)
                                                     : PointToPlaneStep(T, pairs);
}

IcpStep Icp::PointToPointStep(const Pose& T, const pcl::Correspondences& pairs) const {
  std::vector<Eigen::Vector3d> x;
  std::vector<Eigen::Vector3d> y;
  std::vector<double> weights;
  const Pose T_source_target = T.inverse();
  IcpStep step;
  double total = 0.0;
  for (const pcl::Correspondence& pair : pairs) {
    x.push_back(PointOf((*source_)[pair.index_query]));
    y.push_back(T_source_target * PointOf((*target_)[pair.index_match]));
    weights.push_back(WeightOf(pair));
    total += weights.back();
    step.mean_squared_error_before += weights.back() * (x.back() - y.back()).squaredNorm();
  }
  step.mean_squared_error_before /= std::max(total, 1e-300);
  const UmeyamaResult fit = FitRigidTransform(x, y, weights);
  step.solution.step << So3Log(fit.T_y_x.linear()), fit.T_y_x.translation();
  step.solution.degenerate_directions = fit.degenerate_directions;
  step.mean_squared_error_after = fit.rms_m * fit.rms_m;
  step.information = PointInformation(x, std::max(fit.rms_m, 1e-3));
  return step;
}

IcpStep Icp::PointToPlaneStep(const Pose& T, const pcl::Correspondences& pairs) const {
  Matrix6d H = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  double error = 0.0;
  double total = 0.0;
  for (const pcl::Correspondence& pair : pairs) {
    const double weight = WeightOf(pair);
    if (weight == 0.0) continue;
    const Eigen::Vector3d p = PointOf((*source_)[pair.index_query]);
    const Point& q = (*target_)[pair.index_match];
    // The plane in the source frame; a right-hand step moves p by ω × p + v.
    const Eigen::Vector3d n = T.linear().transpose() * NormalOf(q);
    const double r = NormalOf(q).dot(PointOf(q) - T * p);
    Vector6d J;
    J << p.cross(n), n;
    H.noalias() += weight * J * J.transpose();
    b += weight * r * J;
    error += weight * r * r;
    total += weight;
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

bool Icp::Overlaps(const pcl::Correspondences& pairs,
                   const Pose& T_guess,
                   RegistrationResult& result) const {
  result.inliers = static_cast<int>(pairs.size());
  result.overlap = source_->empty()
                       ? 0.0
                       : static_cast<double>(pairs.size()) / static_cast<double>(source_->size());
  if (pairs.size() >= 3 && result.overlap >= options_.min_overlap) return true;
  result.termination = Termination::kTooLittleOverlap;
  result.T_target_source = T_guess;
  return false;
}

RegistrationResult Icp::Run(const Pose& T_guess) {
  if (options_.metric == IcpMetric::kPlaneToPlane) return RunGeneralised(T_guess);
  RegistrationResult result;
  Pose T = T_guess;
  StepExtrapolator extrapolator(options_.extrapolation == IcpExtrapolation::kQuadratic,
                                options_.max_extrapolation,
                                radius_m_);
  for (result.iterations = 1;; ++result.iterations) {
    const pcl::Correspondences pairs = Match(T);
    if (!Overlaps(pairs, T_guess, result)) return result;
    const IcpStep step = StepOf(T, pairs);
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

// What its answer is worth is told by the planes at its end, as for kPointToPlane.
RegistrationResult Icp::RunGeneralised(const Pose& T_guess) {
  RegistrationResult result;
  result.T_target_source = T_guess;
  const auto enough = static_cast<std::size_t>(options_.normal_neighbours);
  if (!Overlaps(Match(T_guess), T_guess, result)) return result;
  if (source_->size() < enough || target_->size() < enough) {
    result.termination = Termination::kTooLittleOverlap;
    return result;
  }
  Gicp gicp;
  gicp.setInputSource(source_);
  gicp.setInputTarget(target_);
  gicp.setMaxCorrespondenceDistance(options_.max_distance_m);
  gicp.setMaximumIterations(options_.max_iterations);
  gicp.setRotationEpsilon(options_.rotation_tolerance_rad);
  gicp.setTransformationEpsilon(options_.translation_tolerance_m);
  gicp.setCorrespondenceRandomness(options_.normal_neighbours);
  Cloud aligned;
  gicp.align(aligned, T_guess.matrix().cast<float>());
  Pose T = Pose::Identity();
  T.matrix() = gicp.getFinalTransformation().cast<double>();
  result.iterations = gicp.iterations();
  if (!WithinBounds(T, T_guess)) {
    result.termination = Termination::kDiverged;
    result.T_target_source = T_guess;
    return result;
  }
  T = Normalized(T);
  const pcl::Correspondences pairs = Match(T);
  if (!Overlaps(pairs, T_guess, result)) return result;
  const IcpStep step = StepOf(T, pairs);
  result.T_target_source = T;
  result.rms_m = std::sqrt(step.mean_squared_error_before);
  result.information = step.information;
  result.degenerate_directions = step.solution.degenerate_directions;
  result.termination = !result.degenerate_directions.empty()         ? Termination::kDegenerate
                       : gicp.iterations() < options_.max_iterations ? Termination::kConverged
                                                                     : Termination::kMaxIterations;
  return result;
}

}  // namespace

absl::Status IcpOptions::Validate() const {
  OptionChecks checks("icp options");
  checks.InRange("max_points", max_points, 3, 1e8);
  checks.InRange("projection_cell_rad", projection_cell_rad, 0.001, 0.5);
  checks.InRange("max_extrapolation", max_extrapolation, 0.0, 100.0);
  checks.InRange("max_distance_m", max_distance_m, 1e-6, 1e4);
  checks.InRange("keep_share", keep_share, 1e-6, 1.0);
  checks.InRange("max_normal_angle_rad", max_normal_angle_rad, 1e-3, std::numbers::pi);
  checks.InRange("normal_neighbours", normal_neighbours, 3, 64);
  checks.InRange("max_iterations", max_iterations, 1, 10000);
  checks.InRange("rotation_tolerance_rad", rotation_tolerance_rad, 0.0, 1.0);
  checks.InRange("translation_tolerance_m", translation_tolerance_m, 0.0, 10.0);
  checks.InRange("min_overlap", min_overlap, 0.0, 1.0);
  checks.InRange("max_translation_m", max_translation_m, 0.0, 1e6);
  checks.InRange("max_rotation_rad", max_rotation_rad, 0.0, 3.15);
  checks.InRange("min_eigenvalue_ratio", min_eigenvalue_ratio, 0.0, 1.0);
  STRATA_RETURN_IF_ERROR(checks.status());
  if (matching == IcpMatching::kProjection && (mutual || metric == IcpMetric::kPlaneToPlane)) {
    return absl::InvalidArgumentError(
        "icp options: mutual pairs and plane-to-plane need closest points; leave out projection");
  }
  return absl::OkStatus();
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
