#include "core/mesh/density_contour.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/mesh_check.h"
#include "tests/core/mesh/shapes.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using testing::StatusIs;

TEST(DensityContourTest, SphereIsClosedInsideAndOutside) {
  const Vector3d centre(500.0, 3.0, -20.0);
  const std::vector<Vector3d> points = testing::SpherePoints(20'000, 1.0, centre);
  const auto mesh = ContourDensity(points, {.voxel_m = 0.05}, Stop());
  STRATA_ASSERT_OK(mesh);
  const MeshCheck check = CheckMesh(*mesh);
  EXPECT_TRUE(check.closed());
  EXPECT_EQ(check.twisted_edges, 0);
  EXPECT_EQ(check.euler_characteristic, 4);  // a ball around and a hollow within
  double nearest = 1.0;
  double farthest = 0.0;
  for (const Vector3d& v : mesh->vertices) {
    const double distance = std::abs((v - centre).norm() - 1.0);
    nearest = std::min(nearest, distance);
    farthest = std::max(farthest, distance);
  }
  EXPECT_GT(nearest, 0.05);  // a voxel
  EXPECT_LT(farthest, 0.13);
}

TEST(DensityContourTest, AClusterOfOutliersDoesNotSetTheScale) {
  std::vector<Vector3d> points = testing::SpherePoints(20'000, 1.0, Vector3d::Zero());
  points.insert(points.end(), 5000, Vector3d(3.0, 0.0, 0.0));
  const auto mesh = ContourDensity(points, {.voxel_m = 0.05}, Stop());
  STRATA_ASSERT_OK(mesh);
  EXPECT_GT(AreaOf(*mesh), 2.0 * 4.0 * 3.0);
}

TEST(DensityContourTest, FewAndOddPoints) {
  const auto none = ContourDensity({}, {}, Stop());
  STRATA_ASSERT_OK(none);
  EXPECT_TRUE(none->triangles.empty());
  const std::vector<Vector3d> one = {{1, 2, 3}};
  const auto ball = ContourDensity(one, {.voxel_m = 0.1}, Stop());
  STRATA_ASSERT_OK(ball);
  EXPECT_TRUE(CheckMesh(*ball).closed());
  const std::vector<Vector3d> bad = {{0, 0, 0}, {std::numeric_limits<double>::quiet_NaN(), 0, 0}};
  EXPECT_THAT(ContourDensity(bad, {}, Stop()),
              StatusIs(absl::StatusCode::kInvalidArgument, ::testing::_));
  std::vector<Vector3d> wide;
  for (int i = 0; i < 20'000; ++i) wide.emplace_back(i, 0.5 * i, 0.1 * i);
  EXPECT_THAT(ContourDensity(wide, {.voxel_m = 0.01, .max_bytes = 1 << 20}, Stop()),
              StatusIs(absl::StatusCode::kResourceExhausted, ::testing::HasSubstr("1 MiB")));
}

}  // namespace
}  // namespace strata
