#include "core/registration/clouds/thinning.h"

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <pcl/filters/voxel_grid.h>
#include <pcl/memory.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

namespace strata {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

constexpr double kMostCubes = 2e9;  // PCL counts them in 32 bits, and keeps all points beyond

float EdgeFor(const Cloud& points, double edge_m) {
  Eigen::AlignedBox3f box;
  for (const pcl::PointXYZ& p : points) box.extend(p.getVector3fMap());
  const Eigen::Array3d sizes = box.sizes().cast<double>();
  while ((sizes / edge_m + 2.0).prod() > kMostCubes) edge_m *= 1.25;
  return static_cast<float>(edge_m);
}

}  // namespace

PointCloud ThinCloud(const PointCloud& cloud, double edge_m) {
  auto points = pcl::make_shared<Cloud>();
  for (const Eigen::Vector3f& p : cloud.points) {
    if (p.allFinite()) points->emplace_back(p.x(), p.y(), p.z());
  }
  PointCloud thinned;
  thinned.origin = cloud.origin;
  thinned.sensor_origin = cloud.sensor_origin;
  if (points->empty()) return thinned;
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setInputCloud(points);
  const float edge = EdgeFor(*points, edge_m);
  grid.setLeafSize(edge, edge, edge);
  Cloud kept;
  grid.filter(kept);
  for (const pcl::PointXYZ& p : kept) thinned.points.push_back(p.getVector3fMap());
  return thinned;
}

}  // namespace strata
