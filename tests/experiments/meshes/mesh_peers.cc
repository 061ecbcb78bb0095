#include "tests/experiments/meshes/mesh_peers.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include <Eigen/Core>
#include <pcl/common/common.h>
#include <pcl/features/normal_3d.h>
#include <pcl/memory.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/surface/impl/marching_cubes.hpp>
#include <pcl/surface/impl/marching_cubes_hoppe.hpp>
#include <pcl/surface/impl/reconstruction.hpp>
#include <pcl/surface/marching_cubes_hoppe.h>

namespace strata::testing {
namespace {

using Oriented = pcl::PointCloud<pcl::PointNormal>;

Oriented::Ptr WithNormals(const std::vector<StoolView>& views) {
  auto all = pcl::make_shared<Oriented>();
  for (const StoolView& view : views) {
    auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
    for (const Eigen::Vector3f& p : view.cloud.points) {
      if (!p.allFinite()) continue;
      const Eigen::Vector3f q = (view.T_world_scan * p.cast<double>()).cast<float>();
      points->emplace_back(q.x(), q.y(), q.z());
    }
    pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
    estimation.setInputCloud(points);
    estimation.setKSearch(16);
    const Eigen::Vector3f from = view.T_world_scan.translation().cast<float>();
    estimation.setViewPoint(from.x(), from.y(), from.z());
    pcl::PointCloud<pcl::Normal> normals;
    estimation.compute(normals);
    for (std::size_t i = 0; i < points->size(); ++i) {
      pcl::PointNormal& point = all->emplace_back();
      point.getVector3fMap() = (*points)[i].getVector3fMap();
      point.getNormalVector3fMap() = normals[i].getNormalVector3fMap();
    }
  }
  return all;
}

}  // namespace

TriangleMesh PclContour(const std::vector<StoolView>& views) {
  const Oriented::Ptr points = WithNormals(views);
  constexpr float kExtend = 0.1F;  // of the box, on both sides together
  pcl::PointNormal low, high;
  pcl::getMinMax3D(*points, low, high);
  const Eigen::Vector3f size = (1.0F + kExtend) * (high.getVector3fMap() - low.getVector3fMap());
  const Eigen::Vector3i nodes = (size / kStoolVoxelM).array().ceil().cast<int>();
  pcl::MarchingCubesHoppe<pcl::PointNormal> hoppe(-1.0F, kExtend, 0.0F);
  hoppe.setGridResolution(nodes.x(), nodes.y(), nodes.z());
  hoppe.setInputCloud(points);
  Oriented corners;
  std::vector<pcl::Vertices> polygons;
  hoppe.reconstruct(corners, polygons);
  TriangleMesh mesh;
  std::map<std::array<long, 3>, std::uint32_t> vertex_at;
  const auto vertex = [&](pcl::index_t corner) {
    const Eigen::Vector3d p =
        corners[static_cast<std::size_t>(corner)].getVector3fMap().cast<double>();
    constexpr double kSame = 1e5;
    const std::array<long, 3> key = {
        std::lround(kSame * p.x()), std::lround(kSame * p.y()), std::lround(kSame * p.z())};
    const auto [it, fresh] =
        vertex_at.emplace(key, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (fresh) mesh.vertices.push_back(p);
    return it->second;
  };
  for (const pcl::Vertices& p : polygons) {
    const Triangle t = {vertex(p.vertices[0]), vertex(p.vertices[1]), vertex(p.vertices[2])};
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh.triangles.push_back(t);
  }
  return mesh;
}

}  // namespace strata::testing
