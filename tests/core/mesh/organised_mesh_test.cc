#include "core/mesh/organised_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/mesh_check.h"
#include "tests/core/mesh/shapes.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using testing::StatusIs;

// A room of 8 × 8 × 3 m around the sensor with a pillar in it, and nothing above.
PointCloud RoomScan() {
  testing::Scene scene;
  scene.Add(testing::Box({-5, -5, -1.5}, {5, 5, -1.0}));
  scene.Add(testing::Box({4, -5, -1}, {4.5, 5, 2}));
  scene.Add(testing::Box({-4.5, -5, -1}, {-4, 5, 2}));
  scene.Add(testing::Box({-5, 4, -1}, {5, 4.5, 2}));
  scene.Add(testing::Box({-5, -4.5, -1}, {5, -4, 2}));
  scene.Add(testing::Box({1.5, -0.2, -1}, {1.9, 0.2, 2}));
  scene.Build();
  testing::SensorOptions sensor;
  sensor.organised = true;
  sensor.sigma_m = 0.0;
  sensor.sigma_per_metre = 0.0;
  return testing::SimulateScan(scene, sensor, Pose::Identity(), 1);
}

TEST(OrganisedMeshTest, RoomWithoutTheShadowsOfItsPillar) {
  const PointCloud cloud = RoomScan();
  const auto mesh = MeshOrganised(cloud);
  STRATA_ASSERT_OK(mesh);
  EXPECT_GT(mesh->triangles.size(), 30'000);
  EXPECT_GT(CheckMesh(*mesh).boundary_edges, 0);
  EXPECT_EQ(CheckMesh(*mesh).nonmanifold_edges, 0);
  for (const Triangle& t : mesh->triangles) {
    const Vector3d normal = AreaNormal(*mesh, t);
    EXPECT_LE(normal.dot(mesh->vertices[t[0]]), 0.0) << "faces away from the sensor";
    // Nothing between the pillar (x ≤ 1.9) and the wall behind it (x = 4) but the floor.
    const Vector3d middle =
        (mesh->vertices[t[0]] + mesh->vertices[t[1]] + mesh->vertices[t[2]]) / 3.0;
    const bool between = std::abs(middle.y()) < 0.4 && middle.x() > 2.2 && middle.x() < 3.9;
    EXPECT_FALSE(between && middle.z() > -0.9) << middle.transpose();
  }
}

// Straight behind, where the first column meets the last.
TEST(OrganisedMeshTest, TurnIsClosed) {
  const auto mesh = MeshOrganised(RoomScan());
  STRATA_ASSERT_OK(mesh);
  bool across = false;
  for (const Triangle& t : mesh->triangles) {
    double low = 1.0;
    double high = -1.0;
    for (const std::uint32_t v : t) {
      low = std::min(low, mesh->vertices[v].y());
      high = std::max(high, mesh->vertices[v].y());
    }
    across = across || (mesh->vertices[t[0]].x() < 0.0 && low < 0.0 && high > 0.0);
  }
  EXPECT_TRUE(across);
}

TEST(OrganisedMeshTest, OddClouds) {
  PointCloud cloud = RoomScan();
  cloud.origin = Vector3d(4e5, 5e6, 0);
  const auto far = MeshOrganised(cloud);
  STRATA_ASSERT_OK(far);
  EXPECT_GT(far->vertices.front().x(), 3e5);
  PointCloud none = cloud;
  none.points.assign(cloud.size(),
                     Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  const auto empty = MeshOrganised(none);
  STRATA_ASSERT_OK(empty);
  EXPECT_TRUE(empty->triangles.empty());
  // One column, and one row.
  PointCloud column;
  column.points = {{1, 0, 0}, {1, 0, 0.1F}, {1, 0, 0.2F}, {1, 0, 0.3F}};
  column.rows = 4;
  column.columns = 1;
  EXPECT_THAT(MeshOrganised(column), StatusIs(absl::StatusCode::kFailedPrecondition, ::testing::_));
  std::swap(column.rows, column.columns);
  EXPECT_THAT(MeshOrganised(column), StatusIs(absl::StatusCode::kFailedPrecondition, ::testing::_));
  cloud.rows = cloud.columns = 0;
  EXPECT_THAT(MeshOrganised(cloud),
              StatusIs(absl::StatusCode::kFailedPrecondition, ::testing::HasSubstr("rows")));
}

}  // namespace
}  // namespace strata
