#include "core/planes/extraction.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <istream>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"
#include "core/mls/build.h"
#include "core/mls/mls_parameters.h"
#include "core/planes/moments.h"
#include "core/planes/scan_planes.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using ::testing::AllOf;
using testing::Box;
using ::testing::HasSubstr;
using testing::Random;
using testing::Scene;
using testing::SensorOptions;
using testing::SimulateScan;
using testing::StatusIs;

// A floor and a building of 12 × 8 × 5 m on it.
Scene Yard() {
  Scene scene;
  scene.Add(Box({-60, -60, -1}, {60, 60, 0}));
  scene.Add(Box({8, -6, 0}, {16, 6, 5}));
  scene.Build();
  return scene;
}

Pose SensorAt(double x, double y, double z) {
  return MakePose(Eigen::Quaterniond::Identity(), {x, y, z});
}

// The patch nearest to `truth` (in the scan frame) by angle and offset, or nullptr.
const PlanePatch* PatchNear(const ScanPlanes& planes, const Plane& truth) {
  for (const PlanePatch& patch : planes.patches) {
    if (patch.plane.normal.dot(truth.normal) > 0.9998 &&
        std::abs(patch.plane.distance - truth.distance) < 0.02) {
      return &patch;
    }
  }
  return nullptr;
}

TEST(PlaneExtractionTest, FindsFloorAndWallsWithTheirSideAndExtent) {
  const Scene scene = Yard();
  const PointCloud cloud = SimulateScan(scene, {}, SensorAt(0, 0, 1.5), 1);
  const ScanPlanes planes = ExtractPlanes(cloud);
  const PlanePatch* floor = PatchNear(planes, {.normal = {0, 0, 1}, .distance = -1.5});
  const PlanePatch* wall = PatchNear(planes, {.normal = {-1, 0, 0}, .distance = -8.0});
  ASSERT_NE(floor, nullptr);
  ASSERT_NE(wall, nullptr);
  EXPECT_NEAR(wall->area_m2, 60.0, 12.0);
  EXPECT_LT(wall->rms_m, 0.03);
  EXPECT_NEAR(wall->extent_max.x() - wall->extent_min.x(), 12.0, 1.0);
  EXPECT_NEAR(wall->extent_max.y() - wall->extent_min.y(), 5.0, 0.8);
}

TEST(PlaneExtractionTest, MomentsAreOfTheAreaAndFitThePlane) {
  const ScanPlanes planes = ExtractPlanes(SimulateScan(Yard(), {}, SensorAt(0, 0, 1.5), 2));
  ASSERT_FALSE(planes.patches.empty());
  for (const PlanePatch& patch : planes.patches) {
    EXPECT_DOUBLE_EQ(patch.moments(3, 3), patch.area_m2);
    EXPECT_NEAR(RmsDistance(patch.moments, patch.plane), patch.rms_m, 1e-6);
    EXPECT_NEAR(Distance(patch.centroid, patch.plane), 0.0, 1e-9);
    EXPECT_GE(SignedDistance(Eigen::Vector3d::Zero(), patch.plane), 0.0);
    EXPECT_NEAR(patch.axis_u.dot(patch.plane.normal), 0.0, 1e-9);
    EXPECT_TRUE((patch.extent_min.array() <= 0.0).all() && (patch.extent_max.array() >= 0.0).all());
  }
  EXPECT_TRUE(std::is_sorted(planes.patches.begin(),
                             planes.patches.end(),
                             [](const auto& a, const auto& b) { return a.area_m2 > b.area_m2; }));
}

// Cells join what noise hides, not what a step shows.
TEST(PlaneExtractionTest, AKerbAndARampAreNotOnePlaneWithTheFloor) {
  Scene scene;
  scene.Add(Box({-60, -60, -1}, {4, 60, 0}));
  scene.Add(Box({4, -60, -1}, {12, 60, 0.08}));
  scene.Add(testing::RampX(-6, -40, -60, 60, 0.0, 1.78));  // 3°
  scene.Build();
  SensorOptions sensor;
  sensor.sigma_m = 0.005;
  sensor.sigma_per_metre = 0.0;
  const ScanPlanes planes = ExtractPlanes(SimulateScan(scene, sensor, SensorAt(0, 0, 1.5), 3));
  EXPECT_NE(PatchNear(planes, {.normal = {0, 0, 1}, .distance = -1.5}), nullptr);
  EXPECT_NE(PatchNear(planes, {.normal = {0, 0, 1}, .distance = -1.42}), nullptr);
  const Plane ramp = MakePlane({1.78, 0, 34}, 1.78 * -6 - 34 * 1.5).value();
  EXPECT_NE(PatchNear(planes, ramp), nullptr);
}

TEST(PlaneExtractionTest, LeavesAndNoiseAreNoPlanes) {
  Random random(4);
  PointCloud cloud;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d p(random.Uniform(2, 12), random.Uniform(-5, 5), random.Uniform(-2, 4));
    cloud.points.push_back(p.cast<float>());
  }
  const ScanPlanes planes = ExtractPlanes(cloud);
  EXPECT_TRUE(planes.patches.empty());
  EXPECT_TRUE(planes.edges.empty());
}

TEST(PlaneExtractionTest, DepthBordersAndCreasesAreEdges) {
  SensorOptions sensor;
  sensor.organised = true;
  sensor.rings = 200;
  const PointCloud cloud = SimulateScan(Yard(), sensor, SensorAt(0, 0, 1.5), 5);
  const ScanPlanes planes = ExtractPlanes(cloud);
  const auto has_edge = [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b, double within) {
    const Line line = MakeLine(a, b - a).value();
    return std::any_of(planes.edges.begin(), planes.edges.end(), [&](const EdgeFeature& e) {
      return e.length_m > 0.6 * (b - a).norm() && Distance(e.points.front(), line) < within &&
             Distance(e.points.back(), line) < within;
    });
  };
  EXPECT_TRUE(has_edge({8, -6, 3.5}, {8, 6, 3.5}, 0.15)) << "roof edge against the sky";
  EXPECT_TRUE(has_edge({8, -6, -1.5}, {8, -6, 3.5}, 0.15)) << "corner";
  EXPECT_TRUE(has_edge({8, 6, -1.5}, {8, 6, 3.5}, 0.15)) << "corner";
  EXPECT_TRUE(has_edge({8, -6, -1.5}, {8, 6, -1.5}, 0.05)) << "crease of wall and floor";
}

TEST(PlaneExtractionTest, AMapOfTheScanGivesTheSamePlanes) {
  const PointCloud cloud = SimulateScan(Yard(), {}, SensorAt(0, 0, 1.5), 6);
  const MlsMap map = BuildMlsMap(cloud, Pose::Identity(), {}, MlsParameters{}).value().map;
  const ScanPlanes planes = ExtractPlanes(map);
  EXPECT_NE(PatchNear(planes, {.normal = {0, 0, 1}, .distance = -1.5}), nullptr);
  const bool wall = std::any_of(planes.patches.begin(), planes.patches.end(), [](const auto& p) {
    return p.plane.normal.x() < -0.999 && std::abs(p.plane.distance + 8.0) < 0.1;
  });
  EXPECT_TRUE(wall);
}

// The same scan in a frame that is moved has the planes moved by as much: it is seen from where the
// sensor was, not from the frame's origin.
TEST(PlaneExtractionTest, AFrameThatIsMovedMovesThePlanesAlone) {
  PointCloud cloud = SimulateScan(Yard(), {}, SensorAt(0, 0, 1.5), 6);
  const ScanPlanes before = ExtractPlanes(cloud);
  const Eigen::Vector3f shift(0.0F, 0.0F, 2.0F);  // the frame: below the floor
  for (Eigen::Vector3f& p : cloud.points) p += shift;
  cloud.sensor_origin = shift;
  PlaneExtractionOptions options;
  options.sensor_origin = shift;
  const MlsMap map = BuildMlsMap(cloud, Pose::Identity(), {}, MlsParameters{}).value().map;
  for (const ScanPlanes& planes : {ExtractPlanes(cloud), ExtractPlanes(map, options)}) {
    EXPECT_NE(PatchNear(planes, {.normal = {0, 0, 1}, .distance = 0.5}), nullptr);
    for (const PlanePatch& patch : planes.patches) {
      EXPECT_GT(SignedDistance(shift.cast<double>(), patch.plane), 0.0);
    }
  }
  EXPECT_EQ(ExtractPlanes(cloud).patches.size(), before.patches.size());
}

TEST(PlaneExtractionTest, TakesEmptyAndHolesAndStrayPoints) {
  EXPECT_EQ(ExtractPlanes(PointCloud{}), ScanPlanes{});
  PointCloud cloud;
  cloud.rows = 2;
  cloud.columns = 3;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  cloud.points.assign(6, Eigen::Vector3f(nan, nan, nan));
  EXPECT_EQ(ExtractPlanes(cloud), ScanPlanes{});
  cloud.points[1] = {1e6F, -1e6F, 1e6F};
  cloud.points[2] = {0, 0, 0};
  EXPECT_EQ(ExtractPlanes(cloud), ScanPlanes{});
}

TEST(PlaneExtractionTest, ChecksOptions) {
  STRATA_EXPECT_OK(PlaneExtractionOptions().Validate());
  PlaneExtractionOptions bad;
  bad.cell_size_m = std::numeric_limits<double>::quiet_NaN();
  bad.max_edges = -1;
  EXPECT_THAT(bad.Validate(),
              StatusIs(absl::StatusCode::kInvalidArgument,
                       AllOf(HasSubstr("cell_size_m"), HasSubstr("max_edges is -1"))));
}

TEST(PlaneExtractionTest, RecordedHallHasItsFloor) {
  STRATA_REQUIRE_DATA(folder, "hall_livox_loop");
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud,
                              testing::ReadBinaryPcd(folder / "scans" / "scan000.pcd"));
  PlaneExtractionOptions options;
  options.sensor.sigma_m = 0.02;
  const ScanPlanes planes = ExtractPlanes(cloud, options);
  ASSERT_FALSE(planes.patches.empty());
  const Plane& floor = planes.patches[0].plane;
  EXPECT_GT(floor.normal.dot(Eigen::Vector3d(-0.0472, 0.0066, 0.9989)), 0.9999);
  EXPECT_NEAR(floor.distance, -1.553, 0.02);
}

// Of a PLY file up to its points; the number of these.
std::size_t SkipPlyHeader(std::istream& in) {
  std::string line;
  std::size_t vertices = 0;
  while (std::getline(in, line) && line != "end_header") {
    if (line.starts_with("element vertex ")) vertices = std::stoul(line.substr(15));
  }
  return vertices;
}

// Binary, x y z as floats; relative to the first point.
PointCloud ReadFloatPly(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  PointCloud cloud;
  cloud.points.resize(SkipPlyHeader(in));
  in.read(reinterpret_cast<char*>(cloud.points.data()),
          static_cast<std::streamsize>(12 * cloud.size()));
  if (!cloud.points.empty()) cloud.origin = cloud.points[0].cast<double>();
  for (Eigen::Vector3f& p : cloud.points) p -= cloud.origin.cast<float>();
  return cloud;
}

// The building's own segments are coarse (some merge the relief of a facade): those that are planes
// to 0.1 m and have 200 points are to be found.
TEST(PlaneExtractionTest, RecordedBuildingHasItsSegments) {
  STRATA_REQUIRE_DATA(folder, "cgal_building_planes");
  std::ifstream in(folder / "building.ply");
  PointCloud cloud;
  std::map<int, Eigen::Matrix4d> segments;
  for (std::size_t left = SkipPlyHeader(in); left > 0; --left) {
    Eigen::Vector3d p;
    Eigen::Vector3d normal;
    int segment = -1;
    in >> p.x() >> p.y() >> p.z() >> normal.x() >> normal.y() >> normal.z() >> segment;
    cloud.points.push_back(p.cast<float>());
    if (segment < 0) continue;
    segments.try_emplace(segment, Eigen::Matrix4d::Zero()).first->second +=
        MomentsOf(1.0, p, Eigen::Matrix3d::Zero());
  }
  ASSERT_TRUE(in.good());
  ASSERT_EQ(segments.size(), 19U);
  const ScanPlanes planes = ExtractPlanes(cloud);
  int flat = 0;
  int found = 0;
  for (const auto& [segment, moments] : segments) {
    const MomentsFit fit = FitMoments(moments);
    if (std::sqrt(fit.eigenvalues(0)) > 0.1 || moments(3, 3) < 200.0) continue;
    ++flat;
    found += std::any_of(planes.patches.begin(), planes.patches.end(), [&](const auto& patch) {
      return std::abs(patch.plane.normal.dot(fit.plane.normal)) > 0.998 &&
             Distance(patch.centroid, fit.plane) < 0.15;
    });
  }
  EXPECT_EQ(flat, 8);
  EXPECT_EQ(found, flat);
}

TEST(PlaneExtractionTest, RecordedStreetHasItsFacadeAndRoad) {
  STRATA_REQUIRE_DATA(folder, "lille_facade");
  PointCloud cloud = ReadFloatPly(folder / "Lille_street_small.ply");
  ASSERT_EQ(cloud.size(), 170610U);
  cloud.sensor_origin = Eigen::Vector3f(0, 0, 3);
  PlaneExtractionOptions options;
  options.sensor.sigma_m = 0.02;
  const ScanPlanes planes = ExtractPlanes(cloud, options);
  double road = 0.0;
  double walls = 0.0;
  for (const PlanePatch& patch : planes.patches) {
    EXPECT_LE(patch.rms_m, options.max_rms_m);
    (std::abs(patch.plane.normal.z()) > 0.9 ? road : walls) += patch.area_m2;
  }
  EXPECT_GT(road, 80.0);
  EXPECT_GT(walls, 80.0);
  EXPECT_GE(planes.edges.size(), 10U);
}

}  // namespace
}  // namespace strata
