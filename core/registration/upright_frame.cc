#include "core/registration/upright_frame.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Eigenvalues>

#include "core/common/hash_map.h"
#include "core/geometry/rotation_between.h"

namespace strata {
namespace {

// Robots drive up ramps of 0.2; who asks where he is on one cannot say that he is tilted.
constexpr double kLeastTiltRad = 0.25;
// Flat pieces, cube by cube.
constexpr float kCubeM = 1.0F;
constexpr float kMostCubes = 1000.0F;  // from the sensor, to every side
constexpr std::size_t kMostPoints = 100'000;
constexpr int kLeastInCube = 10;
constexpr float kMostAcrossM = 0.05F;
constexpr float kLeastAlongM = 0.15F;
constexpr double kAlikeRad = 0.17;  // streets are not level, either

struct Cube {
  int n = 0;
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();  // from the cube's corner
  Eigen::Matrix3f squares = Eigen::Matrix3f::Zero();
};

std::vector<Eigen::Vector3d> FlatNormals(std::span<const Eigen::Vector3f> points) {
  HashMap<std::array<std::int16_t, 3>, Cube> cubes;
  const std::size_t stride = points.size() / kMostPoints + 1;
  for (std::size_t k = 0; k < points.size(); k += stride) {
    const Eigen::Vector3f& p = points[k];
    const Eigen::Vector3f corner = (p / kCubeM).array().floor();
    if (!(corner.array().abs() < kMostCubes).all()) continue;
    const std::array<std::int16_t, 3> key = {static_cast<std::int16_t>(corner.x()),
                                             static_cast<std::int16_t>(corner.y()),
                                             static_cast<std::int16_t>(corner.z())};
    Cube& cube = cubes[key];
    const Eigen::Vector3f d = p - corner * kCubeM;
    ++cube.n;
    cube.sum += d;
    cube.squares += d * d.transpose();
  }
  std::vector<Eigen::Vector3d> normals;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> eigen;
  for (const auto& [key, cube] : cubes) {
    if (cube.n < kLeastInCube) continue;
    const auto n = static_cast<float>(cube.n);
    const Eigen::Vector3f mean = cube.sum / n;
    eigen.computeDirect(cube.squares / n - mean * mean.transpose());
    if (eigen.eigenvalues()[0] > kMostAcrossM * kMostAcrossM ||
        eigen.eigenvalues()[1] < kLeastAlongM * kLeastAlongM) {
      continue;
    }
    normals.emplace_back(eigen.eigenvectors().col(0).cast<double>());
  }
  return normals;
}

}  // namespace

Eigen::Matrix3d UprightTurn(const Eigen::Vector3d& up) {
  if (up.z() >= std::cos(kLeastTiltRad) * up.norm()) return Eigen::Matrix3d::Identity();
  return RotationBetween(up, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

Eigen::Vector3d UpOf(const Pose& T_map_scan) {
  return T_map_scan.linear().transpose() * Eigen::Vector3d::UnitZ();
}

Eigen::Vector3d BelievedUp(std::span<const Eigen::Vector3f> points,
                           const Eigen::Vector3d& up_said) {
  if (UprightTurn(up_said).isIdentity(0.0)) return up_said;
  const std::vector<Eigen::Vector3d> normals = FlatNormals(points);
  const auto fitting = [&](const Eigen::Vector3d& up) {
    return std::ranges::count_if(normals, [&](const Eigen::Vector3d& normal) {
      const double along = std::abs(normal.dot(up));
      return along > std::cos(kAlikeRad) || along < std::sin(kAlikeRad);
    });
  };
  const Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  return fitting(up_said) >= fitting(axis) ? up_said : axis;
}

}  // namespace strata
