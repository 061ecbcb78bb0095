#include "tests/bench/planes/plane_peers.h"

#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include <pcl/features/normal_3d.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/region_growing.h>
#include <pcl/segmentation/sac_segmentation.h>

namespace strata::bench {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
constexpr int kNeighbours = 30;
constexpr std::size_t kMostPlanes = 200;

Cloud::Ptr CloudOf(const PlaneCase& input) {
  auto cloud = pcl::make_shared<Cloud>();
  cloud->reserve(input.points.points.size());
  for (const Eigen::Vector3f& p : input.points.points) cloud->emplace_back(p.x(), p.y(), p.z());
  return cloud;
}

std::vector<std::uint32_t> IndicesOf(const pcl::PointIndices& group) {
  return {group.indices.begin(), group.indices.end()};
}

PointGroups Grown(const PlaneCase& input, double smooth_deg, float curvature) {
  const Cloud::Ptr cloud = CloudOf(input);
  const auto tree = pcl::make_shared<pcl::search::KdTree<pcl::PointXYZ>>();
  auto normals = pcl::make_shared<pcl::PointCloud<pcl::Normal>>();
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setSearchMethod(tree);
  estimation.setInputCloud(cloud);
  estimation.setKSearch(kNeighbours);
  estimation.compute(*normals);
  pcl::RegionGrowing<pcl::PointXYZ, pcl::Normal> growing;
  growing.setMinClusterSize(static_cast<pcl::uindex_t>(input.min_points));
  growing.setSearchMethod(tree);
  growing.setNumberOfNeighbours(kNeighbours);
  growing.setInputCloud(cloud);
  growing.setInputNormals(normals);
  growing.setSmoothnessThreshold(static_cast<float>(smooth_deg * std::numbers::pi / 180.0));
  growing.setCurvatureThreshold(curvature);
  std::vector<pcl::PointIndices> clusters;
  growing.extract(clusters);
  PointGroups groups;
  for (const pcl::PointIndices& cluster : clusters) groups.push_back(IndicesOf(cluster));
  return groups;
}

}  // namespace

PointGroups PclSacPlanes(const PlaneCase& input) {
  const Cloud::Ptr cloud = CloudOf(input);
  pcl::SACSegmentation<pcl::PointXYZ> segmentation;
  segmentation.setOptimizeCoefficients(true);
  segmentation.setModelType(pcl::SACMODEL_PLANE);
  segmentation.setMethodType(pcl::SAC_RANSAC);
  segmentation.setMaxIterations(1000);
  segmentation.setDistanceThreshold(input.near_m);
  segmentation.setInputCloud(cloud);
  auto left = pcl::make_shared<pcl::Indices>();
  for (std::size_t i = 0; i < cloud->size(); ++i) left->push_back(static_cast<pcl::index_t>(i));
  PointGroups groups;
  while (left->size() >= input.min_points && groups.size() < kMostPlanes) {
    segmentation.setIndices(left);
    pcl::PointIndices inliers;
    pcl::ModelCoefficients coefficients;
    segmentation.segment(inliers, coefficients);
    if (inliers.indices.size() < input.min_points) break;
    std::vector<bool> in(cloud->size(), false);
    for (const pcl::index_t i : inliers.indices) in[static_cast<std::size_t>(i)] = true;
    auto rest = pcl::make_shared<pcl::Indices>();
    for (const pcl::index_t i : *left) {
      if (!in[static_cast<std::size_t>(i)]) rest->push_back(i);
    }
    left = rest;
    groups.push_back(IndicesOf(inliers));
  }
  return groups;
}

PointGroups PclGrownPlanes(const PlaneCase& input) { return Grown(input, 3.0, 1.0F); }

PointGroups PclGrownPlanesTuned(const PlaneCase& input) { return Grown(input, 8.0, 0.05F); }

}  // namespace strata::bench
