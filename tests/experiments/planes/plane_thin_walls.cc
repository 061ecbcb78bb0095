// Partitions of 8 to 15 cm between two drawn rooms: each of their faces is a plane of its own.
#include <cmath>
#include <cstdint>
#include <cstdio>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/common/stop.h"
#include "core/geometry/pose.h"
#include "core/geometry/primitives.h"
#include "core/planes/models/plane_model_finder.h"
#include "core/world/plane_model.h"
#include "tests/experiments/meshes/mesh_cases.h"
#include "tests/experiments/planes/plane_cases.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

constexpr int kStands = 3;  // in each room
constexpr double kMostOffM = 0.02, kMostOffDeg = 1.0;

struct TwoRooms {
  PosedPoints points;
  double thick_m = 0.0;
  Plane faces[2];  // of the partition, outward
  Eigen::Vector3d middles[2];
};

// Two rooms of 4 m by 4 m beside each other, turned and moved, so that the cells' grid cuts the
// partition anywhere.
TwoRooms DrawTwoRooms(std::uint64_t seed) {
  Random random(seed);
  TwoRooms world;
  world.thick_m = random.Uniform(0.08, 0.15);
  const double half = world.thick_m / 2.0, height = 2.6, t = 0.2;
  const double end = half + 4.0;
  Scene scene;
  scene.Add(Box({-half, -2.0, 0.0}, {half, 2.0, height}));
  scene.Add(Box({-end - t, -2.0 - t, -t}, {end + t, 2.0 + t, 0.0}));
  scene.Add(Box({-end - t, -2.0 - t, height}, {end + t, 2.0 + t, height + t}));
  scene.Add(Box({-end - t, -2.0 - t, 0.0}, {end + t, -2.0, height}));
  scene.Add(Box({-end - t, 2.0, 0.0}, {end + t, 2.0 + t, height}));
  scene.Add(Box({-end - t, -2.0, 0.0}, {-end, 2.0, height}));
  scene.Add(Box({end, -2.0, 0.0}, {end + t, 2.0, height}));
  scene.Build();
  Pose T_map_world = Pose::Identity();
  const double yaw = random.Uniform(-M_PI, M_PI);
  T_map_world.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  for (double& x : T_map_world.translation()) x = random.Uniform(-1.0, 1.0);
  for (int i = 0; i < 2 * kStands; ++i) {
    const double side = i < kStands ? -1.0 : 1.0;
    Pose T_world_scan = Pose::Identity();
    const double x = random.Uniform(0.8, 3.5), y = random.Uniform(-1.5, 1.5);
    T_world_scan.translation() = Eigen::Vector3d(side * (half + x), y, 1.2);
    const PointCloud scan =
        SimulateScan(scene, {}, T_world_scan, seed + 1000 + static_cast<std::uint64_t>(i));
    const Pose T = T_map_world * T_world_scan;
    for (const Eigen::Vector3f& p : scan.points) {
      world.points.points.push_back((T * p.cast<double>()).cast<float>());
    }
    world.points.views.push_back({T.translation().cast<float>(), world.points.points.size()});
  }
  for (const int side : {0, 1}) {
    const Eigen::Vector3d normal(side == 0 ? -1.0 : 1.0, 0.0, 0.0);
    world.middles[side] = T_map_world * Eigen::Vector3d(half * normal.x(), 0.0, 1.3);
    world.faces[side].normal = T_map_world.linear() * normal;
    world.faces[side].distance = world.faces[side].normal.dot(world.middles[side]);
  }
  return world;
}

// Planes that face as this side of the partition does and lie on it.
int FacesFound(const PlaneModel& model, const TwoRooms& world, int side) {
  int found = 0;
  for (const ModelPlane& plane : model.planes) {
    const double cosine = plane.plane.normal.dot(world.faces[side].normal);
    if (cosine < std::cos(kMostOffDeg / kDegrees) || plane.area_m2 < 5.0) continue;
    if (Distance(world.middles[side], plane.plane) <= kMostOffM) ++found;
  }
  return found;
}

}  // namespace

void ThinWalls(std::uint64_t seed) {
  int both = 0;
  std::printf("a partition between two rooms: thickness in cm, planes on its two faces, all\n");
  for (int i = 0; i < kWorlds; ++i) {
    const TwoRooms world = DrawTwoRooms(seed + static_cast<std::uint64_t>(i));
    const PlaneModel model = OrDie(FindPlaneModel(world.points, {}, Stop()));
    const int found[2] = {FacesFound(model, world, 0), FacesFound(model, world, 1)};
    both += found[0] == 1 && found[1] == 1 ? 1 : 0;
    std::printf(
        "%6.1f %3d %3d %4zu\n", 100.0 * world.thick_m, found[0], found[1], model.planes.size());
  }
  Expect(both == kWorlds, "each face is one plane that faces its room, within 2 cm and 1 degree");
}

}  // namespace strata::testing
