#include "core/registration/facing.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "core/common/hash_map.h"

namespace strata {
namespace {

// Surfaces are judged in blocks of this width and height [m].
constexpr float kBlockM = 0.5F;
constexpr int kMinBlockPoints = 4;
// Standard deviations of points across and along a surface [m]: cells are 0.1 m wide.
constexpr double kMaxAcrossM = 0.05;
constexpr double kMinAlongM = 0.08;
// Sine of the angle at which a surface is seen; below, nobody knows the side.
constexpr float kAlongItself = 0.03F;

struct FlatMoments {
  int n = 0;
  Eigen::Vector2f first = Eigen::Vector2f::Zero();
  Eigen::Vector2f sum = Eigen::Vector2f::Zero();
  Eigen::Matrix2f squares = Eigen::Matrix2f::Zero();

  void Add(const Eigen::Vector2f& p) {
    if (n++ == 0) first = p;
    const Eigen::Vector2f d = p - first;
    sum += d;
    squares += d * d.transpose();
  }
};

Facing FacingTo(const Eigen::Vector2f& direction) {
  constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
  const float turns = std::atan2(direction.y(), direction.x()) / kTurn;
  const int sector = static_cast<int>(std::floor(turns * kFacingSectors));
  return static_cast<Facing>(1 + (sector + kFacingSectors) % kFacingSectors);
}

// Zero where they span no upright surface.
Eigen::Vector2f NormalOf(const FlatMoments& m) {
  if (m.n < kMinBlockPoints) return Eigen::Vector2f::Zero();
  const Eigen::Vector2f mean = m.sum / static_cast<float>(m.n);
  const Eigen::Matrix2d covariance =
      (m.squares / static_cast<float>(m.n) - mean * mean.transpose()).cast<double>();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen;
  eigen.computeDirect(covariance);
  if (eigen.eigenvalues()[0] > kMaxAcrossM * kMaxAcrossM ||
      eigen.eigenvalues()[1] < kMinAlongM * kMinAlongM) {
    return Eigen::Vector2f::Zero();
  }
  return eigen.eigenvectors().col(0).cast<float>();
}

std::uint64_t BlockOf(const Eigen::Vector3f& p) {
  std::uint64_t key = 0;
  for (const float v : p) {
    key =
        key << 21 |
        (static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(v / kBlockM))) & 0x1FFFFF);
  }
  return key;
}

}  // namespace

FacingTurn::FacingTurn(double yaw_rad) {
  const double sectors = yaw_rad / (2.0 * std::numbers::pi) * kFacingSectors;
  turned_[kFacingUnknown] = kFacingUnknown;
  for (int facing = 1; facing <= kFacingSectors; ++facing) {
    const int sector = static_cast<int>(std::floor(facing - 0.5 + sectors));
    turned_[static_cast<std::size_t>(facing)] =
        static_cast<Facing>(1 + (sector % kFacingSectors + kFacingSectors) % kFacingSectors);
  }
}

double YawOf(const Eigen::Matrix3d& R) { return std::atan2(R(1, 0), R(0, 0)); }

std::vector<Facing> FacingsOf(std::span<const Eigen::Vector3f> points,
                              const Eigen::Vector3f& sensor_origin) {
  HashMap<std::uint64_t, std::uint32_t> index;
  std::vector<FlatMoments> blocks;
  std::vector<std::uint32_t> block(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [at, added] =
        index.try_emplace(BlockOf(points[i]), static_cast<std::uint32_t>(blocks.size()));
    if (added) blocks.emplace_back();
    block[i] = at->second;
    blocks[block[i]].Add(points[i].head<2>());
  }
  std::vector<Eigen::Vector2f> normals;
  normals.reserve(blocks.size());
  for (const FlatMoments& moments : blocks) normals.push_back(NormalOf(moments));
  std::vector<Facing> facings(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2f to_sensor = (sensor_origin - points[i]).head<2>();
    const Eigen::Vector2f& normal = normals[block[i]];
    const float side = normal.dot(to_sensor);
    if (normal.isZero()) {
      facings[i] = FacingTo(to_sensor);
    } else if (std::abs(side) <= kAlongItself * to_sensor.norm()) {
      facings[i] = kFacingUnknown;
    } else {
      facings[i] = FacingTo(side > 0.0F ? normal : Eigen::Vector2f(-normal));
    }
  }
  return facings;
}

}  // namespace strata
