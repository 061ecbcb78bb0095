#include "tests/bench/poses/registration_peers.h"

#include <pcl/filters/voxel_grid.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>

namespace strata::bench {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

Cloud::Ptr Thinned(const PointCloud& cloud) {
  auto points = pcl::make_shared<Cloud>();
  points->reserve(cloud.size());
  for (const Eigen::Vector3f& p : cloud.points) points->emplace_back(p.x(), p.y(), p.z());
  pcl::VoxelGrid<pcl::PointXYZ> filter;
  filter.setLeafSize(0.25F, 0.25F, 0.25F);
  filter.setInputCloud(points);
  auto thinned = pcl::make_shared<Cloud>();
  filter.filter(*thinned);
  return thinned;
}

template <typename Method>
Pose Align(Method& method,
           const PointCloud& source,
           const PointCloud& target,
           const Pose& T_target_source_guess) {
  method.setInputSource(Thinned(source));
  method.setInputTarget(Thinned(target));
  method.setMaxCorrespondenceDistance(2.0);
  Cloud aligned;
  method.align(aligned, T_target_source_guess.matrix().cast<float>());
  Pose T = Pose::Identity();
  T.matrix() = method.getFinalTransformation().template cast<double>();
  return Normalized(T);
}

}  // namespace

Pose RegisterWithPcl(Peer peer,
                     const PointCloud& source,
                     const PointCloud& target,
                     const Pose& T_target_source_guess) {
  if (peer == Peer::kIcp) {
    pcl::IterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ> icp;
    icp.setMaximumIterations(50);
    icp.setTransformationEpsilon(1e-8);  // squared metres
    return Align(icp, source, target, T_target_source_guess);
  }
  pcl::GeneralizedIterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ> gicp;
  return Align(gicp, source, target, T_target_source_guess);
}

}  // namespace strata::bench
