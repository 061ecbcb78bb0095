#include "core/mesh/oriented_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <nanoflann.hpp>

#include "core/cloud/point_tree.h"
#include "core/geometry/eigen_solvers.h"

namespace strata {
namespace {

using Eigen::Vector3f;

// Neighbours whose plane a point has: fewer, and the noise of the sensor turns it.
constexpr std::size_t kNeighbours = 16;
constexpr std::size_t kFewestNeighbours = 6;
// Below this ratio of the variances along and across, neighbours are one line of the sensor and say
// nothing about the surface across it.
constexpr float kLine = 0.02F;

std::vector<Vector3f> Centroids(const PointCloud& cloud, double edge_m) {
  using Cube = std::array<std::int32_t, 3>;
  std::vector<std::pair<Cube, std::uint32_t>> cubes;
  cubes.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Vector3f& p = cloud.points[i];
    if (!p.allFinite()) continue;
    Cube cube;
    for (std::size_t k = 0; k < 3; ++k) {
      cube[k] =
          static_cast<std::int32_t>(std::floor(double{p[static_cast<Eigen::Index>(k)]} / edge_m));
    }
    cubes.emplace_back(cube, static_cast<std::uint32_t>(i));
  }
  std::sort(cubes.begin(), cubes.end());
  std::vector<Vector3f> centroids;
  for (std::size_t i = 0; i < cubes.size();) {
    Vector3f sum = Vector3f::Zero();
    const std::size_t begin = i;
    // From a point of the cube, so that the sum loses nothing far from zero.
    const Vector3f& from = cloud.points[cubes[begin].second];
    for (; i < cubes.size() && cubes[i].first == cubes[begin].first; ++i) {
      sum += cloud.points[cubes[i].second] - from;
    }
    centroids.push_back(from + sum / static_cast<float>(i - begin));
  }
  return centroids;
}

// False where the neighbours are in no plane.
bool Orient(const std::vector<Vector3f>& points,
            const std::array<std::uint32_t, kNeighbours>& neighbours,
            std::size_t count,
            const Vector3f& sensor,
            OrientedPoint& point) {
  Vector3f mean = Vector3f::Zero();
  for (std::size_t i = 0; i < count; ++i) mean += points[neighbours[i]] - point.position;
  mean /= static_cast<float>(count);
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d d = (points[neighbours[i]] - point.position - mean).cast<double>();
    scatter += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter / static_cast<double>(count));
  const Eigen::Vector3f variances = solver.eigenvalues().cast<float>();
  if (!(variances.y() > kLine * variances.z())) return false;
  point.normal = solver.eigenvectors().col(0).cast<float>();
  if (point.normal.dot(sensor - point.position) < 0.0F) point.normal = -point.normal;
  // On the plane, where its noise is smallest.
  point.position += point.normal * point.normal.dot(mean);
  point.roughness_m = std::sqrt(std::max(variances.x(), 0.0F));
  return true;
}

}  // namespace

std::vector<OrientedPoint> OrientPoints(const PointCloud& cloud, double edge_m) {
  const std::vector<Vector3f> points = Centroids(cloud, edge_m);
  std::vector<OrientedPoint> oriented;
  if (points.size() < kFewestNeighbours) return oriented;
  const PointsView view{points};
  const PointTree tree(3, view, nanoflann::KDTreeSingleIndexAdaptorParams(12));
  oriented.reserve(points.size());
  std::array<std::uint32_t, kNeighbours> neighbours;
  std::array<float, kNeighbours> squared_m2;
  for (const Vector3f& position : points) {
    const std::size_t count =
        tree.knnSearch(position.data(), kNeighbours, neighbours.data(), squared_m2.data());
    OrientedPoint point;
    point.position = position;
    if (!Orient(points, neighbours, count, cloud.sensor_origin, point)) continue;
    // So many points on a disc as wide as the farthest of them.
    point.spacing_m = std::sqrt(squared_m2[count - 1] * 3.1416F / static_cast<float>(count));
    oriented.push_back(point);
  }
  return oriented;
}

}  // namespace strata
