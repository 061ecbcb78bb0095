// The piano stool of thesis 4.4 and 4.5, drawn, seen from sixteen places, and what meshes of it are
// held against.
#ifndef STRATA_TESTS_EXPERIMENTS_MESHES_STOOL_H_
#define STRATA_TESTS_EXPERIMENTS_MESHES_STOOL_H_

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

#include "core/cloud/point_cloud.h"
#include "core/geometry/pose.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {

// What it is meshed with: half the thickness of its thinnest part has three.
inline constexpr double kStoolVoxelM = 0.008;

struct StoolView {
  PointCloud cloud;  // organised
  Pose T_world_scan = Pose::Identity();
};

// A round seat on a column with five legs, half a metre high.
inline Scene Stool() {
  Scene scene;
  scene.Add(Post(0, 0, 0.44, 0.50, 0.17, 32));
  scene.Add(Post(0, 0, 0.06, 0.45, 0.035, 16));
  for (int leg = 0; leg < 5; ++leg) {
    Eigen::Isometry3d T_world_leg = Eigen::Isometry3d::Identity();
    T_world_leg.rotate(Eigen::AngleAxisd(0.4 * std::numbers::pi * leg, Eigen::Vector3d::UnitZ()));
    T_world_leg.translate(Eigen::Vector3d(0.13, 0, 0.07));
    scene.Add(OrientedBox(T_world_leg, {0.24, 0.05, 0.05}));
  }
  scene.Build();
  return scene;
}

// Where sensors stand around it, and where they look: along x, at the stool's middle.
inline std::vector<Pose> PlacesAroundStool(int count, double distance_m) {
  std::vector<Pose> places;
  for (int i = 0; i < count; ++i) {
    const double azimuth =
        2.0 * std::numbers::pi * (i / 2 + (i % 2 == 0 ? 0.0 : 0.5)) / (count / 2.0);
    const double elevation = i % 2 == 0 ? 0.7 : -0.7;
    const Eigen::AngleAxisd turn(azimuth + std::numbers::pi, Eigen::Vector3d::UnitZ());
    const Eigen::AngleAxisd nod(elevation, Eigen::Vector3d::UnitY());
    const Eigen::Vector3d away(std::cos(azimuth) * std::cos(elevation),
                               std::sin(azimuth) * std::cos(elevation),
                               std::sin(elevation));
    Pose T = Pose::Identity();
    T.linear() = (turn * nod).toRotationMatrix();
    T.translation() = Eigen::Vector3d(0, 0, 0.27) + distance_m * away;
    places.push_back(T);
  }
  return places;
}

inline std::vector<StoolView> SeeStool(const Scene& scene,
                                       const std::vector<Pose>& places,
                                       double sigma_m,
                                       std::uint64_t seed) {
  SensorOptions sensor;
  sensor.rings = 220;
  sensor.columns = 2000;
  sensor.elevation_min_rad = -0.35;
  sensor.elevation_max_rad = 0.35;
  sensor.max_range_m = 5.0;
  sensor.min_range_m = 0.1;
  sensor.sigma_m = sigma_m;
  sensor.sigma_per_metre = 0.0;
  sensor.organised = true;
  std::vector<StoolView> views;
  for (const Pose& T : places) {
    views.push_back({SimulateScan(scene, sensor, T, seed + views.size()), T});
  }
  return views;
}

// Its surface as points with normals: what forty sensors without noise see.
struct SurfacePoint {
  Eigen::Vector3d position;
  Eigen::Vector3d normal;
};
inline std::vector<SurfacePoint> SurfaceOf(const Scene& scene) {
  std::vector<SurfacePoint> surface;
  for (const StoolView& view : SeeStool(scene, PlacesAroundStool(40, 1.3), 0.0, 99)) {
    for (const Eigen::Vector3f& p : view.cloud.points) {
      if (!p.allFinite()) continue;
      SurfacePoint& point = surface.emplace_back();
      point.position = view.T_world_scan * p.cast<double>();
      double nearest = 1.0;
      for (const Solid& solid : scene.solids()) {
        // The face that it lies on, of the solid that it is on the border of.
        const Solid::Face* face = &solid.faces.front();
        for (const Solid::Face& f : solid.faces) {
          const bool farther = f.normal.dot(point.position) - f.offset >
                               face->normal.dot(point.position) - face->offset;
          if (farther) face = &f;
        }
        const double off = std::abs(face->normal.dot(point.position) - face->offset);
        if (off >= nearest) continue;
        nearest = off;
        point.normal = face->normal;
      }
    }
  }
  return surface;
}

}  // namespace strata::testing

#endif  // STRATA_TESTS_EXPERIMENTS_MESHES_STOOL_H_
