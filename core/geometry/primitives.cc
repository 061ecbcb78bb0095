#include "core/geometry/primitives.h"

#include <cmath>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include <Eigen/Geometry>

namespace strata {
namespace {

constexpr double kMinLength = 1e-12;
constexpr double kParallelSine = 1e-9;

absl::Status CheckDirection(const char* what, const Eigen::Vector3d& v) {
  if (v.allFinite() && v.stableNorm() >= kMinLength) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(what,
                                                 " (",
                                                 v.x(),
                                                 ", ",
                                                 v.y(),
                                                 ", ",
                                                 v.z(),
                                                 ") has no direction; give a finite vector of "
                                                 "length 1e-12 or more"));
}

absl::Status NotParallel(const char* what, double angle_rad, double tolerance_rad) {
  return absl::FailedPreconditionError(absl::StrCat(what,
                                                    ": ",
                                                    angle_rad,
                                                    " rad from parallel, bound ",
                                                    tolerance_rad,
                                                    "; only parallel ones have a distance"));
}

}  // namespace

absl::StatusOr<Line> MakeLine(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  if (!origin.allFinite()) return absl::InvalidArgumentError("line: origin is not finite");
  if (const absl::Status status = CheckDirection("line: direction", direction); !status.ok()) {
    return status;
  }
  return Line{.origin = origin, .direction = direction.stableNormalized()};
}

absl::StatusOr<Plane> MakePlane(const Eigen::Vector3d& normal, double distance) {
  if (const absl::Status status = CheckDirection("plane: normal", normal); !status.ok()) {
    return status;
  }
  // A short normal may also take a finite distance beyond all numbers.
  const double from_origin = distance / normal.stableNorm();
  if (!std::isfinite(from_origin)) {
    return absl::InvalidArgumentError("plane: distance is not finite");
  }
  return Plane{.normal = normal.stableNormalized(), .distance = from_origin};
}

Plane Canonical(const Plane& plane) {
  const Eigen::Vector3d& n = plane.normal;
  bool flip = plane.distance < 0.0;
  if (plane.distance == 0.0) {
    const double last = n.z() != 0.0 ? n.z() : (n.y() != 0.0 ? n.y() : n.x());
    flip = last < 0.0;
  }
  if (!flip) return plane;
  return {.normal = -n, .distance = -plane.distance};
}

Bearing BearingOf(const Eigen::Vector3d& unit) {
  return {.azimuth_rad = std::atan2(unit.y(), unit.x()),
          .elevation_rad = std::atan2(unit.z(), std::hypot(unit.x(), unit.y()))};
}

Eigen::Vector3d UnitVector(const Bearing& bearing) {
  const double horizontal = std::cos(bearing.elevation_rad);
  return {horizontal * std::cos(bearing.azimuth_rad),
          horizontal * std::sin(bearing.azimuth_rad),
          std::sin(bearing.elevation_rad)};
}

double SignedDistance(const Eigen::Vector3d& point, const Plane& plane) {
  return plane.normal.dot(point) - plane.distance;
}

double Distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return (a - b).norm(); }

double Distance(const Eigen::Vector3d& point, const Line& line) {
  // Equal to 2.11, without its cancellation near the line.
  return line.direction.cross(point - line.origin).norm();
}

double Distance(const Eigen::Vector3d& point, const Plane& plane) {
  return std::abs(SignedDistance(point, plane));
}

double Distance(const Line& a, const Line& b) {
  const Eigen::Vector3d across = a.direction.cross(b.direction);
  const double sine = across.norm();
  if (sine < kParallelSine) return Distance(a.origin, b);
  return std::abs((b.origin - a.origin).dot(across)) / sine;
}

absl::StatusOr<double> Distance(const Line& line, const Plane& plane, double tolerance_rad) {
  const double sine = std::abs(line.direction.dot(plane.normal));
  const double angle = std::atan2(sine, line.direction.cross(plane.normal).norm());
  if (angle > tolerance_rad) return NotParallel("line and plane", angle, tolerance_rad);
  return Distance(line.origin, plane);
}

absl::StatusOr<double> Distance(const Plane& a, const Plane& b, double tolerance_rad) {
  const double cosine = a.normal.dot(b.normal);
  const double angle = std::atan2(a.normal.cross(b.normal).norm(), std::abs(cosine));
  if (angle > tolerance_rad) return NotParallel("two planes", angle, tolerance_rad);
  return cosine > 0.0 ? std::abs(a.distance - b.distance) : std::abs(a.distance + b.distance);
}

}  // namespace strata
