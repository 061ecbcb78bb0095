// Points, lines and planes, and the distances between them (thesis 2.4). Metres and radians. A
// plane is n · x = d throughout, where the thesis changes the sign of d between equations.
#ifndef STRATA_CORE_GEOMETRY_PRIMITIVES_H_
#define STRATA_CORE_GEOMETRY_PRIMITIVES_H_

#include "absl/status/statusor.h"
#include <Eigen/Core>

namespace strata {

// The points origin + s · direction; |direction| = 1. MakeLine holds the invariant.
struct Line {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
};

// The points x with normal · x = distance; |normal| = 1. MakePlane holds the invariant.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double distance = 0.0;
};

// INVALID_ARGUMENT if a number is not finite or the direction is shorter than 1e-12.
absl::StatusOr<Line> MakeLine(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction);

// The plane normal · x = distance, brought to a unit normal. INVALID_ARGUMENT as MakeLine.
absl::StatusOr<Plane> MakePlane(const Eigen::Vector3d& normal, double distance);

// The same plane with distance ≥ 0, so that the normal points away from the origin; a plane through
// the origin gets its last non-zero component positive (upward).
Plane Canonical(const Plane& plane);

// A unit vector as angles (eq. 2.9): azimuth in [−π, π] from x towards y (0 for a vertical vector),
// elevation in [−π/2, π/2] above the xy plane.
struct Bearing {
  double azimuth_rad = 0.0;
  double elevation_rad = 0.0;
};
Bearing BearingOf(const Eigen::Vector3d& unit);
Eigen::Vector3d UnitVector(const Bearing& bearing);

// n · q − d: positive on the side the normal points to.
double SignedDistance(const Eigen::Vector3d& point, const Plane& plane);

// Distances (2.10–2.13), ≥ 0. Lines whose directions differ by less than about 1e-9 rad count as
// parallel.
double Distance(const Eigen::Vector3d& a, const Eigen::Vector3d& b);
double Distance(const Eigen::Vector3d& point, const Line& line);
double Distance(const Eigen::Vector3d& point, const Plane& plane);
double Distance(const Line& a, const Line& b);

// Distances that exist for parallel objects only (2.14, 2.15): FAILED_PRECONDITION if the angle
// between them is more than `tolerance_rad`. Planes with opposite normals are |d₁ + d₂| apart.
inline constexpr double kParallelToleranceRad = 1e-6;
absl::StatusOr<double> Distance(const Line& line,
                                const Plane& plane,
                                double tolerance_rad = kParallelToleranceRad);
absl::StatusOr<double> Distance(const Plane& a,
                                const Plane& b,
                                double tolerance_rad = kParallelToleranceRad);

}  // namespace strata

#endif  // STRATA_CORE_GEOMETRY_PRIMITIVES_H_
