#include "core/planes/posed_patch.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"
#include "core/planes/moments.h"
#include "core/planes/scan_planes.h"
#include "core/planes/shared_planes.h"

namespace strata {
namespace {

constexpr double kGate = 3.0;
constexpr double kTiltFloorRad = 0.001;  // surfaces and sensors are no truer: 1 cm over 10 m

double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

int FootprintSize(const PlanePatch& patch) {
  int count = 0;
  for (const std::uint32_t row : patch.footprint) count += std::popcount(row);
  return count;
}

bool OnFootprint(const PlanePatch& patch, const Eigen::Vector2d& at) {
  const Eigen::Vector2d square = (at - patch.extent_min) / patch.footprint_cell_m;
  if (!(square.x() >= 0.0 && square.y() >= 0.0 && square.y() < 32.0 &&
        square.x() < static_cast<double>(patch.footprint.size()))) {
    return false;
  }
  const std::uint32_t row = patch.footprint[static_cast<std::size_t>(square.x())];
  return (row >> static_cast<int>(square.y()) & 1U) != 0;
}

// Whether at least this share of the squares of `a` lies on `b`.
bool LiesOn(const PosedPatch& a, const PosedPatch& b, double share) {
  if (a.squares == 0) return share <= 0.0;
  const Eigen::Vector3d a_v = a.plane.normal.cross(a.axis_u);
  const Eigen::Vector3d b_v = b.plane.normal.cross(b.axis_u);
  const auto is_enough = [&](int squares) {
    return static_cast<double>(squares) / a.squares >= share;
  };
  int on = 0;
  int left = a.squares;
  for (std::size_t i = 0; i < a.patch->footprint.size(); ++i) {
    for (std::uint32_t row = a.patch->footprint[i]; row != 0; row &= row - 1) {
      const Eigen::Vector2d at =
          a.patch->extent_min +
          a.patch->footprint_cell_m *
              Eigen::Vector2d(static_cast<double>(i) + 0.5, std::countr_zero(row) + 0.5);
      const Eigen::Vector3d p = a.centroid + at.x() * a.axis_u + at.y() * a_v - b.centroid;
      on += OnFootprint(*b.patch, {b.axis_u.dot(p), b_v.dot(p)}) ? 1 : 0;
      --left;
    }
    if (is_enough(on)) return true;
    if (!is_enough(on + left)) return false;
  }
  return false;
}

}  // namespace

PosedPatch InMap(const PlanePatch& patch,
                 std::size_t scan,
                 const Pose& T_map_scan,
                 const SharedPlaneOptions& options) {
  PosedPatch posed;
  posed.patch = &patch;
  posed.scan = scan;
  posed.squares = FootprintSize(patch);
  posed.T_map_scan = T_map_scan;
  posed.measurements =
      std::clamp(patch.area_m2 / options.independent_area_m2, 1.0, options.max_measurements);
  posed.variance_m2 = std::pow(std::max(patch.rms_m, options.sigma_floor_m), 2);
  posed.centroid = T_map_scan * patch.centroid;
  posed.axis_u = T_map_scan.linear() * patch.axis_u;
  posed.plane.normal = T_map_scan.linear() * patch.plane.normal;
  posed.plane.distance = posed.plane.normal.dot(posed.centroid);
  const double weight = posed.measurements / posed.variance_m2;
  posed.information = Moved(T_map_scan, weight / patch.moments(3, 3) * patch.moments);
  const Eigen::Vector3d axis_v = patch.plane.normal.cross(patch.axis_u);
  for (const double a : {patch.extent_min.x(), patch.extent_max.x()}) {
    for (const double b : {patch.extent_min.y(), patch.extent_max.y()}) {
      posed.box.extend(T_map_scan * (patch.centroid + a * patch.axis_u + b * axis_v));
    }
  }
  posed.offset_sigma_m = 1.0 / std::sqrt(weight);
  posed.spread_m = std::sqrt(FitMoments(patch.moments).eigenvalues(1));
  posed.tilt_sigma_rad = posed.offset_sigma_m / std::max(posed.spread_m, 0.01);
  const double height = patch.plane.normal.dot(patch.centroid);
  posed.lever_m = std::sqrt(std::max(0.0, patch.centroid.squaredNorm() - height * height));
  return posed;
}

bool Overlap(const PosedPatch& a, const PosedPatch& b, double share) {
  const auto area = [](const PosedPatch& p) {
    return p.squares * p.patch->footprint_cell_m * p.patch->footprint_cell_m;
  };
  return area(a) <= area(b) ? LiesOn(a, b, share) : LiesOn(b, a, share);
}

double BentAway(const PosedPatch& patch, const Eigen::Vector3d& at) {
  const Eigen::Vector3d& k = patch.patch->curvature;
  Eigen::Matrix2d K;
  K << k(0), k(1), k(1), k(2);
  const Eigen::Vector3d away = patch.centroid - at;
  const Eigen::Vector2d x(patch.axis_u.dot(away), patch.plane.normal.cross(patch.axis_u).dot(away));
  const double offset = 0.5 * x.dot(K * x);
  return std::hypot(offset, (K * x).norm() * patch.spread_m);
}

bool Fits(const PosedPatch& patch, const JointPlane& joint, const SharedPlaneOptions& options) {
  const double joint_tilt_sigma = options.pose_sigma_rad / std::sqrt(joint.scans);
  const double tilt_sigma =
      std::hypot(patch.tilt_sigma_rad, options.pose_sigma_rad, joint_tilt_sigma);
  if (AngleBetween(patch.plane.normal, joint.plane.normal) > kGate * tilt_sigma) return false;
  const double own_sigma = std::hypot(
      patch.offset_sigma_m, options.pose_sigma_m, options.pose_sigma_rad * patch.lever_m);
  const double joint_sigma = std::hypot(options.pose_sigma_m / std::sqrt(joint.scans),
                                        joint_tilt_sigma * Distance(patch.centroid, joint.mean));
  return Distance(patch.centroid, joint.plane) <= kGate * std::hypot(own_sigma, joint_sigma);
}

PatchBrief BriefOf(const PosedPatch& patch, const SharedPlaneOptions& options) {
  return {.normal = patch.plane.normal,
          .centroid = patch.centroid,
          .tilt_sigma_rad = patch.tilt_sigma_rad,
          .own_sigma_m =
              patch.offset_sigma_m + options.pose_sigma_m + options.pose_sigma_rad * patch.lever_m,
          .area_m2 = patch.patch->area_m2};
}

// A sum is at least the root of its squares' sum, and cos x at least 1 − x²/2.
bool MayFit(const PatchBrief& patch, const JointPlane& joint, const SharedPlaneOptions& options) {
  constexpr double kRounding = 1e-9;
  const double tilt = kGate * (patch.tilt_sigma_rad + 2.0 * options.pose_sigma_rad);
  if (patch.normal.dot(joint.plane.normal) < 1.0 - 0.5 * tilt * tilt - kRounding) return false;
  const double joint_sigma =
      options.pose_sigma_m + options.pose_sigma_rad * Distance(patch.centroid, joint.mean);
  return Distance(patch.centroid, joint.plane) <=
         kGate * (patch.own_sigma_m + joint_sigma) + kRounding;
}

bool Coplanar(const PosedPatch& a, const PosedPatch& b, double sigma_floor_m) {
  const double tilt_sigma = std::hypot(a.tilt_sigma_rad, b.tilt_sigma_rad, kTiltFloorRad);
  if (AngleBetween(a.plane.normal, b.plane.normal) > kGate * tilt_sigma) return false;
  const double apart = Distance(a.centroid, b.centroid);
  const auto offset_fits = [apart, sigma_floor_m](const PosedPatch& from, const PosedPatch& to) {
    const double sigma = std::hypot(
        sigma_floor_m, to.offset_sigma_m, std::max(from.tilt_sigma_rad, kTiltFloorRad) * apart);
    return Distance(to.centroid, from.plane) <= kGate * sigma;
  };
  return offset_fits(a, b) && offset_fits(b, a);
}

}  // namespace strata
