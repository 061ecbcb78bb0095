#include "core/registration/plane_to_plane.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>
#include <Eigen/LU>

#include "core/geometry/skew.h"
#include "core/registration/column_grid.h"
#include "core/registration/faces.h"
#include "core/registration/mls_registration.h"
#include "core/registration/scan_features.h"

namespace strata {
namespace {

// How far a query may move before its nearest feature is looked up again; more makes the look-up
// slower. Features are a cell apart.
constexpr float kMaxSlackM = 0.03F;
// Rounding of coordinates and distances in float.
constexpr float kRoundingM = 1e-4F;

// Sines of the angles at which a surface is seen; closer to its own plane nobody knows the side.
constexpr double kGrazing = 0.1;

// True if a surface with this normal at p, seen from `a`, is seen from its other side from `b`.
bool OppositeSides(const Eigen::Vector3d& p,
                   const Eigen::Vector3d& normal,
                   const Eigen::Vector3d& a,
                   const Eigen::Vector3d& b) {
  const double side_a = normal.dot(a - p);
  const double side_b = normal.dot(b - p);
  return side_a * side_b < 0.0 && std::abs(side_a) > kGrazing * (a - p).norm() &&
         std::abs(side_b) > kGrazing * (b - p).norm();
}

// True if the target's surface was seen from nowhere but the other side: a deck's underside by all
// who drove below it, say, or by those who saw that place. Beams of a sparse scan draw lines on it
// which look like tops.
bool IsOtherSide(const SurfaceElement& q,
                 FeatureClass c,
                 std::uint32_t index,
                 const Eigen::Vector3f& normal_source,
                 const Eigen::Vector3d& sensor,
                 const RegistrationTarget& target) {
  if (target.sensors().empty()) return false;
  const Eigen::Vector3d point = q.point.cast<double>();
  const Eigen::Vector3d normal = (q.normal.isZero() ? normal_source : q.normal).cast<double>();
  if (c == FeatureClass::kTraversable && !target.toward_below().empty()) {
    const Eigen::Vector3f& toward = target.toward_below()[index];
    if (!toward.isZero()) {
      return OppositeSides(point, normal, sensor, point + toward.cast<double>());
    }
  }
  return std::ranges::all_of(target.sensors(), [&](const Eigen::Vector3d& other) {
    return OppositeSides(point, normal, sensor, other);
  });
}

// Where beams draw lines on a wall, a cell wide and far apart, neighbours lie on a level strip. Its
// height goes with the distance of the sensor: held against each other such strips lift whatever is
// in front of a robot, and a chain of scans bends upwards. So features more than 3° above the
// sensor that look level, and are no undersides, only count as overlap. Below the horizon they
// are ground, too, and all that holds a scan of a floor with little on it. On a ramp that is both
// the robot's own horizon and that of the vertical: what lies between them, the ramp ahead and the
// floor behind, is seen as flat as strips are.
bool MayBeStripOnAWall(const SampledFeature& feature, const ScanFeatures& scan) {
  constexpr double kSine = 0.05;
  const Eigen::Vector3d to_point = feature.element.point.cast<double>() - scan.sensor_origin();
  const double above = std::max(to_point.z(), to_point.dot(scan.up()));
  return feature.feature_class != FeatureClass::kNonTraversable && above > kSine * to_point.norm();
}

bool IsLevel(const Eigen::Vector3d& normal) {
  constexpr double kLevel = 0.95;  // cosine of its inclination; roofs rise more
  return std::abs(normal.z()) > kLevel;
}

// A line that a beam drew says nothing about the surface that it lies on, whose normal is zero
// then: the other side's, if that knows better, is the normal of both.
void ShareNormals(Eigen::Vector3d& normal_p, Eigen::Vector3d& normal_q) {
  if (normal_p.isZero()) normal_p = normal_q;
  if (normal_q.isZero()) normal_q = normal_p;
}

// True for normals of two surfaces, though each may err.
bool AreOfTwo(const Eigen::Vector3d& normal_p, const Eigen::Vector3d& normal_q) {
  constexpr double kCosine = 0.5;
  return !normal_p.isZero() && !normal_q.isZero() && std::abs(normal_p.dot(normal_q)) < kCosine;
}

// True for matches that only count as overlap: two lines of beams, whose places on a surface go
// with the sensor's, what may be one, and two surfaces.
bool SaysNothing(const SampledFeature& feature,
                 const Eigen::Vector3d& normal_p,
                 const Eigen::Vector3d& normal_q,
                 const ScanFeatures& scan) {
  if (feature.feature_class != FeatureClass::kVertical && normal_p.isZero()) return true;
  if (AreOfTwo(normal_p, normal_q)) return true;
  return (IsLevel(normal_p) || IsLevel(normal_q)) && MayBeStripOnAWall(feature, scan);
}

// Symmetric part of n_p n_qᵀ, whatever their signs.
Eigen::Matrix3d Agreed(const Eigen::Vector3d& normal_p, const Eigen::Vector3d& normal_q) {
  const double half = normal_p.dot(normal_q) < 0.0 ? -0.5 : 0.5;
  return half * (normal_p * normal_q.transpose() + normal_q * normal_p.transpose());
}

// Adds w JᵀMJ, J = [−P, I], but for its lower left block.
void AddUpper(double w, const Eigen::Matrix3d& P, const Eigen::Matrix3d& M, Matrix6d& H) {
  const Eigen::Matrix3d PM = P * M;
  H.topLeftCorner<3, 3>() -= w * PM * P;  // Pᵀ = −P
  H.topRightCorner<3, 3>() += w * PM;
  H.bottomRightCorner<3, 3>() += w * M;
}

}  // namespace

PlaneToPlaneMatcher::PlaneToPlaneMatcher(const ScanFeatures& source,
                                         const RegistrationTarget& target,
                                         const MlsRegistrationOptions& options)
    : source_(source), target_(target), options_(options) {
  known_.resize(source.sample().size());
  for (int c = 0; c < kFeatureClasses; ++c) {
    element_index_[c].assign(target.grid(static_cast<FeatureClass>(c)).points().size(), 0);
  }
}

const PlaneToPlaneMatcher::TargetSurface& PlaneToPlaneMatcher::SurfaceAt(
    FeatureClass c,
    std::uint32_t index,
    const Eigen::Vector3f& sensor,
    const Eigen::Vector3f& normal) {
  std::uint32_t& known = element_index_[static_cast<std::size_t>(c)][index];
  if (known != 0) return surfaces_[known - 1];
  const ColumnGrid& grid = target_.grid(c);
  const auto radius_m = static_cast<float>(options_.neighbour_radius_m);
  TargetSurface surface{
      FitSurfaceElement(grid, grid.points()[index], options_.neighbours, radius_m)};
  if (c == FeatureClass::kVertical && !target_.upright_sides().empty() && !normal.isZero()) {
    surface.is_other_face =
        FaceTowards(
            target_, index, sensor, normal, options_.neighbours, radius_m, surface.element) ==
        Face::kOther;
  }
  surfaces_.push_back(surface);
  known = static_cast<std::uint32_t>(surfaces_.size());
  return surfaces_.back();
}

std::uint32_t PlaneToPlaneMatcher::Match(std::size_t sample,
                                         const Eigen::Vector3f& p_target,
                                         float gate_m,
                                         bool fine) {
  const ColumnGrid& grid = target_.grid(source_.sample()[sample].feature_class);
  KnownMatch& known = known_[sample];
  if (!fine) return known.match.index = grid.Nearest(p_target, gate_m, known.match.index);
  const float slack_m = known.match.slack_m - kRoundingM;
  if (slack_m <= 0.0F || (p_target - known.p_target).squaredNorm() >= slack_m * slack_m) {
    known.match = grid.NearestWithSlack(p_target, gate_m, kMaxSlackM, known.match.index);
    known.p_target = p_target;
  }
  const std::uint32_t j = known.match.index;
  if (j == ColumnGrid::kNone || (grid.points()[j] - p_target).squaredNorm() >= gate_m * gate_m) {
    return ColumnGrid::kNone;
  }
  return j;
}

PlaneToPlaneSums PlaneToPlaneMatcher::Linearise(const Pose& T_target_source,
                                                double gate_m,
                                                bool fine) {
  PlaneToPlaneSums sums;
  const Eigen::Matrix3d R = T_target_source.linear();
  const Eigen::Vector3d t = T_target_source.translation();
  const Eigen::Vector3d sensor = T_target_source * source_.sensor_origin();
  const double tangent2 = options_.tangent_sigma_m * options_.tangent_sigma_m;
  const double flattening = tangent2 - options_.normal_sigma_m * options_.normal_sigma_m;
  const double inverse_width2 = 1.0 / (options_.robust_width * options_.robust_width);
  const std::size_t limit =
      static_cast<std::size_t>(fine ? options_.max_samples : options_.coarse_samples);
  const std::size_t n = std::min(limit, source_.sample().size());
  sums.selected = static_cast<int>(n);
  for (std::size_t i = 0; i < n; ++i) {
    const SampledFeature& sampled = source_.sample()[i];
    const Eigen::Vector3d p = sampled.element.point.cast<double>();
    const Eigen::Vector3d p_target = R * p + t;
    const std::uint32_t j = Match(i, p_target.cast<float>(), static_cast<float>(gate_m), fine);
    if (j == ColumnGrid::kNone) continue;
    const Eigen::Vector3f normal = R.cast<float>() * sampled.element.normal;
    const TargetSurface& surface =
        SurfaceAt(sampled.feature_class, j, sensor.cast<float>(), normal);
    if (surface.is_other_face) continue;
    const SurfaceElement& q = surface.element;
    if (IsOtherSide(q, sampled.feature_class, j, normal, sensor, target_)) continue;
    const Eigen::Vector3d r = R.transpose() * (q.point.cast<double>() - p_target);
    Eigen::Vector3d normal_p = sampled.element.normal.cast<double>();
    Eigen::Vector3d normal_q = R.transpose() * q.normal.cast<double>();
    if (sampled.feature_class != FeatureClass::kVertical) ShareNormals(normal_p, normal_q);
    if (SaysNothing(sampled, normal_p, normal_q, source_)) {
      ++sums.inliers;
      continue;
    }
    const Eigen::Matrix3d C =
        2.0 * tangent2 * Eigen::Matrix3d::Identity() -
        flattening * (normal_p * normal_p.transpose() + normal_q * normal_q.transpose());
    const Eigen::Matrix3d M = C.inverse();
    const Eigen::Vector3d Mr = M * r;
    const double error = r.dot(Mr);
    const double w = 1.0 / (1.0 + error * inverse_width2);
    const Eigen::Matrix3d P = Skew(p);
    AddUpper(w, P, M, sums.H);
    AddUpper(w, P, Agreed(normal_p, normal_q), sums.H_across);
    if (!normal_p.isZero() && !normal_q.isZero()) {
      const double cosine = normal_p.dot(normal_q);
      sums.squared_lean += 1.0 - cosine * cosine;
      ++sums.leans;
    }
    sums.b.head<3>() += w * P * Mr;
    sums.b.tail<3>() += w * Mr;
    sums.weight += w;
    sums.squared_error += w * error;
    const double distance = r.dot(normal_q);
    sums.squared_distance_m2 += distance * distance;
    sums.squared_radius_m2 += p.squaredNorm();
    ++sums.inliers;
  }
  for (Matrix6d* H : {&sums.H, &sums.H_across}) {
    H->bottomLeftCorner<3, 3>() = H->topRightCorner<3, 3>().transpose();
  }
  sums.H_across /= 2.0 * options_.normal_sigma_m * options_.normal_sigma_m;
  return sums;
}

}  // namespace strata
