// Points of a scan as small pieces of surface.
// Internal to core/mesh, not installed.
#ifndef STRATA_CORE_MESH_ORIENTED_POINTS_H_
#define STRATA_CORE_MESH_ORIENTED_POINTS_H_

#include <vector>

#include <Eigen/Core>

#include "core/cloud/point_cloud.h"

namespace strata {

// In the scan frame.
struct OrientedPoint {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  // towards the sensor
  float spacing_m = 0.0F;    // distance to the next points of the surface, roughly
  float roughness_m = 0.0F;  // standard deviation of its neighbours from their plane
};

// The centre of gravity of the points in each cube of `edge_m`, with the plane of its nearest
// neighbours. Points without neighbours in a plane (of lines, and alone) are left out. In an order
// that only the points decide. `cloud`: as ValidateCloud() takes it.
std::vector<OrientedPoint> OrientPoints(const PointCloud& cloud, double edge_m);

}  // namespace strata

#endif  // STRATA_CORE_MESH_ORIENTED_POINTS_H_
