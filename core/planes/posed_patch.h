// A patch in the map frame, with what is known about its accuracy.
// Internal to core/planes, not installed.
#ifndef STRATA_CORE_PLANES_POSED_PATCH_H_
#define STRATA_CORE_PLANES_POSED_PATCH_H_

#include <cstddef>

#include <Eigen/Geometry>

#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"
#include "core/planes/scan_planes.h"
#include "core/planes/shared_planes.h"

namespace strata {

struct PosedPatch {
  const PlanePatch* patch = nullptr;
  std::size_t scan = 0;
  int squares = 0;  // of its footprint
  Pose T_map_scan;
  double measurements = 0.0;  // independent ones
  double variance_m2 = 0.0;   // of each
  // In the map frame.
  Plane plane;
  Eigen::Vector3d centroid, axis_u;
  Eigen::Matrix4d information;  // moments of total weight measurements / variance
  Eigen::AlignedBox3d box;
  // σ of the plane by the patch alone: at the centroid, and of the normal.
  double offset_sigma_m = 0.0;
  double tilt_sigma_rad = 0.0;
  double spread_m = 0.0;  // of the points along its shorter side
  double lever_m = 0.0;   // from the sensor to the centroid, along the plane
};

PosedPatch InMap(const PlanePatch& patch,
                 std::size_t scan,
                 const Pose& T_map_scan,
                 const SharedPlaneOptions& options);

// Whether at least this share of the patch with the smaller footprint lies on the other one when
// looked at along the normal of that other one.
bool Overlap(const PosedPatch& a, const PosedPatch& b, double share);

// How far the patch lies from a plane that touches the surface at `at`, because the surface is bent
// between there and the patch [m]; 0 for what is flat.
double BentAway(const PosedPatch& patch, const Eigen::Vector3d& at);

// A plane through patches of `scans` scans, whose poses err independently.
struct JointPlane {
  Plane plane;
  Eigen::Vector3d mean;  // of what it goes through
  double scans = 1.0;
};

// True if a patch can lie in the plane, given the accuracy of both and the errors of poses that the
// options allow; 3σ. The normals must point to the same side.
bool Fits(const PosedPatch& patch, const JointPlane& joint, const SharedPlaneOptions& options);

// What most patches are refused by, packed densely.
struct PatchBrief {
  Eigen::Vector3d normal, centroid;
  double tilt_sigma_rad = 0.0;
  double own_sigma_m = 0.0;  // of its offset and its own pose; at least that of Fits()
  double area_m2 = 0.0;
};

PatchBrief BriefOf(const PosedPatch& patch, const SharedPlaneOptions& options);

// False only for what does not fit: Fits() by bounds of what it works out.
bool MayFit(const PatchBrief& patch, const JointPlane& joint, const SharedPlaneOptions& options);

// True if two patches of one scan can be one plane: no pose is between them. 3σ, where none is
// known better than sigma_floor_m and 1 mrad.
bool Coplanar(const PosedPatch& a, const PosedPatch& b, double sigma_floor_m);

}  // namespace strata

#endif  // STRATA_CORE_PLANES_POSED_PATCH_H_
