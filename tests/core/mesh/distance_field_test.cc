#include "core/mesh/distance_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/mesh/mesh_check.h"
#include "tests/core/mesh/shapes.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Eigen::Vector3d;
using testing::At;
using testing::StatusIs;

struct PosedCloud {
  PointCloud cloud;
  Pose T_map_scan;
};

TriangleMesh MeshOf(const std::vector<PosedCloud>& scans, const DistanceFieldOptions& options) {
  DistanceField field(options);
  for (const PosedCloud& scan : scans) {
    STRATA_EXPECT_OK(field.Add(scan.cloud, scan.T_map_scan, SensorModel(), Stop()));
  }
  for (const PosedCloud& scan : scans) {
    STRATA_EXPECT_OK(field.Carve(scan.cloud, scan.T_map_scan, SensorModel(), Stop()));
  }
  const auto mesh = field.Mesh(Stop());
  STRATA_EXPECT_OK(mesh);
  return mesh.value_or(TriangleMesh());
}

// A ball of 1 m seen from fourteen places.
std::vector<PosedCloud> BallScans(const Vector3d& centre) {
  const std::vector<Vector3d> points = testing::SpherePoints(30'000, 1.0, centre);
  std::vector<PosedCloud> scans;
  for (const Vector3d& from : testing::SpherePoints(14, 5.0, centre)) {
    scans.push_back({testing::SphereSeenFrom(from, points, centre), At(from)});
  }
  return scans;
}

// Height 2 m and width 4 m at x = `x`, seen from the origin.
PointCloud WallAt(double x) {
  PointCloud cloud;
  for (double y = -2.0; y <= 2.0; y += 0.03) {
    for (double z = -1.0; z <= 1.0; z += 0.03) {
      cloud.points.emplace_back(Vector3d(x, y, z).cast<float>());
    }
  }
  return cloud;
}

TEST(DistanceFieldTest, BallIsClosedAndHasItsVolume) {
  const Vector3d centre(1000.3, -2000.1, 7.0);
  const TriangleMesh mesh = MeshOf(BallScans(centre), {.voxel_m = 0.05});
  const MeshCheck check = CheckMesh(mesh);
  EXPECT_TRUE(check.closed()) << check.boundary_edges << " edges of the border";
  EXPECT_TRUE(check.manifold());
  EXPECT_EQ(check.euler_characteristic, 2);
  EXPECT_NEAR(VolumeOf(mesh), testing::SphereVolume(1.0), 0.01 * testing::SphereVolume(1.0));
  for (const Vector3d& v : mesh.vertices) EXPECT_NEAR((v - centre).norm(), 1.0, 0.01);
}

TEST(DistanceFieldTest, NoiseAveragesOut) {
  std::vector<PosedCloud> scans = BallScans(Vector3d::Zero());
  testing::Random random(1);
  for (PosedCloud& scan : scans) {
    for (Eigen::Vector3f& p : scan.cloud.points) {
      p += p.normalized() * static_cast<float>(0.02 * random.Gaussian());
    }
  }
  const TriangleMesh mesh = MeshOf(scans, {.voxel_m = 0.05});
  EXPECT_TRUE(CheckMesh(mesh).closed());
  double squared = 0.0;
  for (const Vector3d& v : mesh.vertices) squared += std::pow(v.norm() - 1.0, 2);
  EXPECT_LT(std::sqrt(squared / static_cast<double>(mesh.vertices.size())), 0.008);
}

TEST(DistanceFieldTest, WallFacesTheSensorOnOneSide) {
  const TriangleMesh mesh = MeshOf({{WallAt(3.0), Pose::Identity()}}, {.voxel_m = 0.05});
  ASSERT_FALSE(mesh.triangles.empty());
  EXPECT_NEAR(AreaOf(mesh), 8.0, 0.8);
  for (const Triangle& t : mesh.triangles) EXPECT_LT(AreaNormal(mesh, t).x(), 0.0);
  for (const Vector3d& v : mesh.vertices) EXPECT_NEAR(v.x(), 3.0, 1e-3);
}

TEST(DistanceFieldTest, ThinWallKeepsItsTwoSides) {
  PointCloud front = WallAt(3.0);
  PointCloud back = WallAt(2.8);  // from the other side, 6 m away: at x = 3.2
  Pose T_map_back = At({6.0, 0.0, 0.0});
  T_map_back.rotate(Eigen::AngleAxisd(M_PI, Vector3d::UnitZ()));
  const TriangleMesh mesh =
      MeshOf({{front, Pose::Identity()}, {back, T_map_back}}, {.voxel_m = 0.05});
  double area_front = 0.0;
  double area_back = 0.0;
  for (const Triangle& t : mesh.triangles) {
    const Vector3d normal = AreaNormal(mesh, t);
    const double x = mesh.vertices[t[0]].x();
    if (std::abs(x - 3.0) < 0.01 && normal.x() < 0.0) area_front += 0.5 * normal.norm();
    if (std::abs(x - 3.2) < 0.01 && normal.x() > 0.0) area_back += 0.5 * normal.norm();
  }
  EXPECT_GT(area_front, 7.2);
  EXPECT_GT(area_back, 7.2);
  EXPECT_LT(AreaOf(mesh) - area_front - area_back, 0.8);
}

TEST(DistanceFieldTest, WhatOthersLookThroughIsTakenOut) {
  PointCloud person;
  for (double y = -0.3; y <= 0.3; y += 0.02) {
    for (double z = -0.4; z <= 0.4; z += 0.02) {
      person.points.emplace_back(Vector3d(1.5, y, z).cast<float>());
    }
  }
  const auto near_person = [](const TriangleMesh& mesh) {
    return std::count_if(
        mesh.vertices.begin(), mesh.vertices.end(), [](const Vector3d& v) { return v.x() < 2.0; });
  };
  const PosedCloud seen_once{person, Pose::Identity()};
  const PosedCloud wall{WallAt(3.0), Pose::Identity()};
  EXPECT_GT(near_person(MeshOf({seen_once}, {.voxel_m = 0.05})), 100);
  const TriangleMesh mesh = MeshOf({seen_once, wall, wall, wall}, {.voxel_m = 0.05});
  EXPECT_EQ(near_person(mesh), 0);
  EXPECT_NEAR(AreaOf(mesh), 8.0, 0.8);
}

TEST(DistanceFieldTest, OnlyTheRegionIsMeshed) {
  DistanceFieldOptions options{.voxel_m = 0.05};
  options.region = Eigen::AlignedBox3d(Vector3d(0, 0, -10), Vector3d(10, 10, 10));
  const TriangleMesh mesh = MeshOf({{WallAt(3.0), Pose::Identity()}}, options);
  ASSERT_FALSE(mesh.triangles.empty());
  for (const Vector3d& v : mesh.vertices) EXPECT_GT(v.y(), -0.3);
  options.region = Eigen::AlignedBox3d(Vector3d(5, 5, 5), Vector3d(6, 6, 6));
  EXPECT_TRUE(MeshOf({{WallAt(3.0), Pose::Identity()}}, options).triangles.empty());
}

TEST(DistanceFieldTest, SameBytesAgain) {
  const std::vector<PosedCloud> scans = BallScans(Vector3d::Zero());
  const TriangleMesh a = MeshOf(scans, {.voxel_m = 0.1});
  const TriangleMesh b = MeshOf(scans, {.voxel_m = 0.1});
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
}

TEST(DistanceFieldTest, SaysWhatDoesNotFit) {
  DistanceField small({.voxel_m = 0.01, .max_bytes = std::size_t{2} << 20});
  EXPECT_THAT(small.Add(WallAt(3.0), Pose::Identity(), SensorModel(), Stop()),
              StatusIs(absl::StatusCode::kResourceExhausted,
                       ::testing::AllOf(::testing::HasSubstr("2 MiB"),
                                        ::testing::HasSubstr("larger voxels"))));
  DistanceFieldOptions anywhere{.voxel_m = 0.01};
  anywhere.region = {Vector3d::Constant(-1e9), Vector3d::Constant(1e9)};
  DistanceField far(anywhere);
  STRATA_EXPECT_OK(far.Add(WallAt(3.0), Pose::Identity(), SensorModel(), Stop()));
  EXPECT_THAT(far.Add(WallAt(3.0), At({5e7, 0, 0}), SensorModel(), Stop()),
              StatusIs(absl::StatusCode::kOutOfRange, ::testing::HasSubstr("region")));
  EXPECT_THAT(DistanceFieldOptions{.voxel_m = 0.0}.Validate(),
              StatusIs(absl::StatusCode::kInvalidArgument, ::testing::HasSubstr("voxel_m is 0")));
  EXPECT_THAT(DistanceFieldOptions{.voxel_m = std::numeric_limits<double>::quiet_NaN()}.Validate(),
              StatusIs(absl::StatusCode::kInvalidArgument, ::testing::_));
}

TEST(DistanceFieldTest, OddCloudsGiveNothing) {
  PointCloud line;
  for (int i = 0; i < 100; ++i) line.points.emplace_back(3.0F, 0.01F * static_cast<float>(i), 0.0F);
  PointCloud same;
  same.points.assign(100, Eigen::Vector3f(1, 1, 1));
  PointCloud none;
  none.rows = 2;
  none.columns = 2;
  none.points.assign(4, Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_TRUE(MeshOf({{line, Pose::Identity()},
                      {same, Pose::Identity()},
                      {none, Pose::Identity()},
                      {PointCloud(), Pose::Identity()}},
                     {.voxel_m = 0.05})
                  .triangles.empty());
}

}  // namespace
}  // namespace strata
