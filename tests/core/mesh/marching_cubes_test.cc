#include "core/mesh/marching_cubes.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/common/random.h"
#include "core/mesh/mesh_check.h"
#include "tests/core/mesh/shapes.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using testing::StatusIs;

constexpr float kAnyStep = std::numeric_limits<float>::infinity();
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

std::vector<BlockKey> CubeOfBlocks(int from, int to) {
  std::vector<BlockKey> keys;
  for (int x = from; x < to; ++x) {
    for (int y = from; y < to; ++y) {
      for (int z = from; z < to; ++z) keys.push_back({x, y, z});
    }
  }
  return keys;
}

Vector3d NodeAt(const BlockKey& key, std::size_t node) {
  return {key.x * 8.0 + static_cast<double>(node & 7),
          key.y * 8.0 + static_cast<double>(node >> 3 & 7),
          key.z * 8.0 + static_cast<double>(node >> 6)};
}

TriangleMesh March(const std::vector<BlockKey>& keys,
                   const std::function<float(const Vector3d&)>& f,
                   float outside = 1.0F) {
  const NodeGrid grid{.origin = {100.0, -50.0, 3.0}, .spacing_m = 0.1};
  const auto mesh = MarchCubes(
      keys,
      [&](std::size_t i, std::size_t node) { return f(NodeAt(keys[i], node)); },
      outside,
      kAnyStep,
      grid,
      Stop());
  EXPECT_THAT(mesh, testing::IsOk());
  return mesh.value_or(TriangleMesh());
}

float Sphere(const Vector3d& node) {
  return static_cast<float>((node - Vector3d(1.3, -0.4, 0.7)).norm() - 13.2);
}

TEST(MarchingCubesTest, SphereHasItsVolumeAndArea) {
  const TriangleMesh mesh = March(CubeOfBlocks(-3, 3), Sphere);
  const MeshCheck check = CheckMesh(mesh);
  EXPECT_TRUE(check.closed());
  EXPECT_TRUE(check.manifold());
  EXPECT_EQ(check.euler_characteristic, 2);
  const double volume = testing::SphereVolume(1.32);
  EXPECT_NEAR(VolumeOf(mesh), volume, 0.01 * volume);
  EXPECT_NEAR(AreaOf(mesh), 4.0 * std::numbers::pi * 1.32 * 1.32, 0.01 * AreaOf(mesh));
  for (const Vector3d& v : mesh.vertices) {
    EXPECT_NEAR((v - Vector3d(100.13, -50.04, 3.07)).norm(), 1.32, 0.002);
  }
}

TEST(MarchingCubesTest, TorusHasAHandle) {
  const TriangleMesh mesh = March(CubeOfBlocks(-3, 3), [](const Vector3d& p) {
    return static_cast<float>(std::hypot(std::hypot(p.x(), p.y()) - 14.0, p.z()) - 5.0);
  });
  EXPECT_TRUE(CheckMesh(mesh).closed());
  EXPECT_EQ(CheckMesh(mesh).euler_characteristic, 0);
  const double volume = 2.0 * std::pow(std::numbers::pi, 2) * 1.4 * 0.25;
  EXPECT_NEAR(VolumeOf(mesh), volume, 0.02 * volume);
}

// Every case of the table beside every other: no two cubes disagree on the face that they share.
TEST(MarchingCubesTest, NoiseIsClosed) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    SplitMix64 random(seed);
    std::vector<float> values(8 * kBlockNodes);
    for (float& v : values) v = static_cast<float>(random.Uniform() - 0.5);
    const std::vector<BlockKey> keys = CubeOfBlocks(-1, 1);
    const auto mesh = MarchCubes(
        keys,
        [&](std::size_t i, std::size_t node) { return values[i * kBlockNodes + node]; },
        1.0F,
        kAnyStep,
        NodeGrid(),
        Stop());
    STRATA_ASSERT_OK(mesh);
    EXPECT_GT(mesh->triangles.size(), 4000);
    EXPECT_TRUE(CheckMesh(*mesh).closed());
    EXPECT_EQ(CheckMesh(*mesh).twisted_edges, 0);
    EXPECT_GT(VolumeOf(*mesh), 0.0);
  }
}

// The blocks that hold the surface are enough, in any order.
TEST(MarchingCubesTest, SparseBlocksGiveTheSameMesh) {
  const std::vector<BlockKey> all = CubeOfBlocks(-3, 3);
  std::vector<BlockKey> near;
  for (const BlockKey& key : all) {
    const double middle = (Vector3d(key.x, key.y, key.z) * 8.0 + Vector3d::Constant(3.5)).norm();
    if (std::abs(middle - 13.2) < 12.0) near.push_back(key);
  }
  ASSERT_LT(near.size(), all.size());
  std::reverse(near.begin(), near.end());
  const TriangleMesh dense = March(all, Sphere);
  const TriangleMesh sparse = March(near, Sphere, kNaN);
  EXPECT_EQ(sparse.vertices, dense.vertices);
  EXPECT_EQ(sparse.triangles, dense.triangles);
}

TEST(MarchingCubesTest, UnknownNodesLeaveABorder) {
  const TriangleMesh mesh = March(CubeOfBlocks(-3, 3), [](const Vector3d& node) {
    return node.z() > 8.0 ? kNaN : Sphere(node);
  });
  EXPECT_GT(CheckMesh(mesh).boundary_edges, 0);
  EXPECT_TRUE(CheckMesh(mesh).manifold());
  for (const Vector3d& v : mesh.vertices) EXPECT_LE(v.z(), 3.8 + 1e-9);
}

// Inside up to the middle, then outside at once: two things side by side, no surface.
TEST(MarchingCubesTest, SteepStepsAreNoSurface) {
  const std::vector<BlockKey> keys = CubeOfBlocks(-1, 1);
  const auto step = [&](std::size_t i, std::size_t node) {
    return NodeAt(keys[i], node).x() < 0.0 ? -1.5F : 1.5F;
  };
  const auto all = MarchCubes(keys, step, kNaN, 3.5F, NodeGrid(), Stop());
  STRATA_ASSERT_OK(all);
  EXPECT_FALSE(all->triangles.empty());
  const auto none = MarchCubes(keys, step, kNaN, 2.5F, NodeGrid(), Stop());
  STRATA_ASSERT_OK(none);
  EXPECT_TRUE(none->triangles.empty());
}

TEST(MarchingCubesTest, NothingGivesNothingAndStopStops) {
  EXPECT_TRUE(March({}, Sphere).triangles.empty());
  Stop stop;
  stop.Request();
  EXPECT_THAT(MarchCubes(
                  {{0, 0, 0}}, [](auto, auto) { return 1.0F; }, 1.0F, kAnyStep, NodeGrid(), stop),
              StatusIs(absl::StatusCode::kCancelled, ::testing::_));
}

}  // namespace
}  // namespace strata
