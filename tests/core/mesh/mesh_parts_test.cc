#include "core/mesh/mesh_parts.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/distance_field.h"
#include "core/mesh/mesh_check.h"
#include "tests/core/mesh/shapes.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using testing::At;
using testing::StatusIs;

constexpr double kPartVoxelM = 0.05;
constexpr std::size_t kAnyNumber = std::numeric_limits<std::size_t>::max();

struct BallScan {
  PointCloud cloud;
  Pose T_map_scan;
};

// Two balls, and a wall between them that the rays to one of them go through.
std::vector<BallScan> TwoBalls() {
  std::vector<BallScan> scans;
  for (const double x : {-3.2, 2.7}) {
    const Vector3d centre(x, 0.4, 1.0);
    const std::vector<Vector3d> points = testing::SpherePoints(20'000, 0.9, centre);
    for (const Vector3d& from : testing::SpherePoints(10, 4.0, centre)) {
      scans.push_back({testing::SphereSeenFrom(from, points, centre), At(from)});
    }
  }
  PointCloud wall;
  for (double y = -1.0; y <= 1.0; y += 0.03) {
    for (double z = -1.0; z <= 1.0; z += 0.03) wall.points.emplace_back(1.0, y, z);
  }
  scans.push_back({wall, At({-1.2, 0.0, 1.0})});
  return scans;
}

TriangleMesh MeshOf(const std::vector<BallScan>& scans, const DistanceFieldOptions& options) {
  DistanceField field(options);
  for (const BallScan& scan : scans) {
    STRATA_EXPECT_OK(field.Add(scan.cloud, scan.T_map_scan, SensorModel(), Stop()));
  }
  for (const BallScan& scan : scans) {
    STRATA_EXPECT_OK(field.Carve(scan.cloud, scan.T_map_scan, SensorModel(), Stop()));
  }
  const auto mesh = field.Mesh(Stop());
  STRATA_EXPECT_OK(mesh);
  return mesh.value_or(TriangleMesh());
}

// In an order of their own: corners from the least on, round as they were.
std::vector<std::array<double, 9>> CornersOf(const TriangleMesh& mesh) {
  std::vector<std::array<double, 9>> all;
  for (const Triangle& t : mesh.triangles) {
    std::array<std::array<double, 3>, 3> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vector3d& v = mesh.vertices[t[k]];
      corners[k] = {v.x(), v.y(), v.z()};
    }
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    std::array<double, 9> nine{};
    for (std::size_t k = 0; k < 9; ++k) nine[k] = corners[k / 3][k % 3];
    all.push_back(nine);
  }
  std::sort(all.begin(), all.end());
  return all;
}

MeshCutter CutterOf(const std::vector<BallScan>& scans) {
  MeshCutter cutter(DistanceField::OriginFor(scans[0].cloud, scans[0].T_map_scan, kPartVoxelM),
                    kPartVoxelM,
                    DistanceFieldOptions().region);
  for (const BallScan& scan : scans) {
    STRATA_EXPECT_OK(cutter.Add(scan.cloud, scan.T_map_scan, Stop()));
  }
  return cutter;
}

TEST(MeshPartsTest, JoinedTheyAreTheMeshOfAll) {
  const std::vector<BallScan> scans = TwoBalls();
  const TriangleMesh whole = MeshOf(scans, {.voxel_m = kPartVoxelM});
  const MeshCutter cutter = CutterOf(scans);
  const std::vector<FieldPart> parts = cutter.Parts(cutter.blocks() / 7);
  EXPECT_GE(parts.size(), 8U);
  MeshJoiner joiner(kPartVoxelM);
  std::size_t reached = 0;
  for (const FieldPart& part : parts) {
    std::vector<BallScan> some;
    for (std::size_t i = 0; i < scans.size(); ++i) {
      if (cutter.Reaches(i, part)) some.push_back(scans[i]);
    }
    reached += some.size();
    const DistanceFieldOptions options{.voxel_m = kPartVoxelM, .part = part};
    STRATA_EXPECT_OK(joiner.Append(MeshOf(some, options), part, kAnyNumber));
  }
  EXPECT_LT(reached, parts.size() * scans.size());
  const TriangleMesh joined = joiner.Finish();
  EXPECT_EQ(CornersOf(joined), CornersOf(whole));
  EXPECT_EQ(joined.vertices.size(), whole.vertices.size());
  EXPECT_EQ(CheckMesh(joined).boundary_edges, CheckMesh(whole).boundary_edges);
}

TEST(MeshPartsTest, HalvesLieSideBySide) {
  const FieldPart part{Vector3d::Ones(), {{-3, 0, 0}, {4, 2, 1}}};
  const auto [a, b] = Halves(part);
  EXPECT_EQ(a.blocks.low, part.blocks.low);
  EXPECT_EQ(b.blocks.high, part.blocks.high);
  EXPECT_EQ(a.blocks.high.x, b.blocks.low.x);
  EXPECT_GT(a.blocks.high.x, -3);
  EXPECT_LT(a.blocks.high.x, 4);
  EXPECT_FALSE(IsOneBlock(part));
  EXPECT_TRUE(IsOneBlock({Vector3d::Zero(), {{5, 5, 5}, {6, 6, 6}}}));
}

TEST(MeshPartsTest, NothingHasNoParts) {
  MeshCutter cutter(Vector3d::Zero(), kPartVoxelM, DistanceFieldOptions().region);
  EXPECT_TRUE(cutter.Parts(10).empty());
  STRATA_EXPECT_OK(cutter.Add(PointCloud(), Pose::Identity(), Stop()));
  EXPECT_TRUE(cutter.Parts(10).empty());
  EXPECT_TRUE(MeshJoiner(kPartVoxelM).Finish().triangles.empty());
}

TEST(MeshPartsTest, SaysWhereThereAreTooManyTriangles) {
  const std::vector<BallScan> scans = TwoBalls();
  const TriangleMesh mesh = MeshOf(scans, {.voxel_m = 0.1});
  MeshJoiner joiner(0.1);
  EXPECT_THAT(joiner.Append(mesh, {Vector3d::Zero(), {{-9, -9, -9}, {9, 9, 9}}}, 10),
              StatusIs(absl::StatusCode::kResourceExhausted, ::testing::HasSubstr("10 triangles")));
}

}  // namespace
}  // namespace strata
