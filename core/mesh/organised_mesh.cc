#include "core/mesh/organised_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>
#include <pcl/memory.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/surface/impl/organized_fast_mesh.hpp>  // of no library: PCL's for surfaces brings VTK
#include <pcl/surface/organized_fast_mesh.h>

namespace strata {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

constexpr float kUsualDistances = 4.0F;
constexpr float kLongestM = 0.5F;
constexpr float kGrazingRad = 0.05F;

// The median distance of neighbours along the rows and across them, divided by their range: the
// larger one.
float UsualDistance(const PointCloud& cloud) {
  float largest = 0.0F;
  for (const std::size_t step : {std::size_t{1}, std::size_t{cloud.columns}}) {
    std::vector<float> shares;
    for (std::size_t i = 0; i + step < cloud.size(); ++i) {
      const float range_m = (cloud.points[i] - cloud.sensor_origin).norm();
      const float share = (cloud.points[i + step] - cloud.points[i]).norm() / range_m;
      if (std::isfinite(share)) shares.push_back(share);
    }
    if (shares.empty()) continue;
    const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
    std::nth_element(shares.begin(), middle, shares.end());
    largest = std::max(largest, *middle);
  }
  return largest;
}

// The first column stands again behind the last: a sensor that turns sees them side by side.
Cloud::Ptr WithSeam(const PointCloud& cloud) {
  auto grid = pcl::make_shared<Cloud>(cloud.columns + 1, cloud.rows);
  for (std::uint32_t row = 0; row < cloud.rows; ++row) {
    for (std::uint32_t column = 0; column <= cloud.columns; ++column) {
      const Eigen::Vector3f& p =
          cloud.points[std::size_t{row} * cloud.columns + column % cloud.columns];
      grid->at(column, row) = {p.x(), p.y(), p.z()};
    }
  }
  grid->is_dense = false;
  return grid;
}

bool TooLong(const TriangleMesh& mesh, const Triangle& t) {
  for (std::size_t i = 0; i < 3; ++i) {
    if ((mesh.vertices[t[i]] - mesh.vertices[t[(i + 1) % 3]]).norm() > kLongestM) return true;
  }
  return false;
}

}  // namespace

absl::StatusOr<TriangleMesh> MeshOrganised(const PointCloud& cloud) {
  if (cloud.rows < 2 || cloud.columns < 2) {
    return absl::FailedPreconditionError(
        "the scan has no rows and columns, so nothing says which points are neighbours; the other "
        "methods need none");
  }
  pcl::OrganizedFastMesh<pcl::PointXYZ> mesher;
  mesher.setInputCloud(WithSeam(cloud));
  mesher.setTriangulationType(pcl::OrganizedFastMesh<pcl::PointXYZ>::TRIANGLE_ADAPTIVE_CUT);
  mesher.setViewpoint(cloud.sensor_origin);
  mesher.setMaxEdgeLength(0.0F, kUsualDistances * UsualDistance(cloud));
  mesher.setAngleTolerance(kGrazingRad);
  std::vector<pcl::Vertices> polygons;
  mesher.reconstruct(polygons);
  TriangleMesh mesh;
  mesh.colour = cloud.colour;
  const Eigen::Vector3d sensor = cloud.origin + cloud.sensor_origin.cast<double>();
  for (const Eigen::Vector3f& p : cloud.points) {
    mesh.vertices.emplace_back(cloud.origin + p.cast<double>());
  }
  const auto point_of = [&](pcl::index_t i) {
    const auto pixel = static_cast<std::uint32_t>(i);
    const std::uint32_t row = pixel / (cloud.columns + 1);
    return row * cloud.columns + pixel % (cloud.columns + 1) % cloud.columns;
  };
  for (const pcl::Vertices& p : polygons) {
    Triangle t = {point_of(p.vertices[0]), point_of(p.vertices[1]), point_of(p.vertices[2])};
    const bool across_seam_only = t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
    if (across_seam_only || TooLong(mesh, t)) continue;
    if (AreaNormal(mesh, t).dot(sensor - mesh.vertices[t[0]]) < 0.0) std::swap(t[1], t[2]);
    mesh.triangles.push_back(t);
  }
  DropUnusedVertices(mesh);
  return mesh;
}

}  // namespace strata
