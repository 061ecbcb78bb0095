// Plane models (thesis 5.3 to 5.5) on drawn rooms and recorded buildings: exits 1 where a bound
// does not hold, 77 where recorded data are absent.
//
// Usage: plane_models rooms|walls|rack|boxes|carpet|jacket|corridor|thin [seed]
//        plane_models building|hall
//        plane_models FOLDER   (prints the planes of a recording with scans and reference poses)
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/common/stop.h"
#include "core/geometry/primitives.h"
#include "core/planes/models/plane_model_finder.h"
#include "core/world/plane_model.h"
#include "tests/experiments/meshes/mesh_cases.h"
#include "tests/experiments/planes/plane_cases.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

// ---- Table 5.1: a room with five walls, a table and a box on it ----

struct Face {
  const char* name;
  Plane plane;  // world frame
  Eigen::Vector3d centre;
  bool small = false;  // of the table or the box
};

struct Room {
  Scene scene;
  std::vector<Face> faces;
};

// Rectangular but for a cut corner; the box stands at one of three places of the table.
Room DrawRoom(Random& random, int place) {
  Room room;
  const double width = random.Uniform(4.0, 6.0), depth = random.Uniform(4.0, 6.0), height = 2.8;
  const double t = 0.2;
  const auto wall = [&](const char* name,
                        const Eigen::Vector3d& normal,
                        double distance,
                        const Eigen::Vector3d& centre,
                        const Solid& solid) {
    room.scene.Add(solid);
    room.faces.push_back({name, {normal, distance}, centre});
  };
  wall("floor",
       {0, 0, 1},
       0,
       {width / 2, depth / 2, 0},
       Box({-t, -t, -t}, {width + t, depth + t, 0}));
  wall("ceiling",
       {0, 0, -1},
       -height,
       {width / 2, depth / 2, height},
       Box({-t, -t, height}, {width + t, depth + t, height + t}));
  wall("west", {1, 0, 0}, 0, {0, depth / 2, 1.4}, Box({-t, -t, 0}, {0, depth + t, height}));
  wall("east",
       {-1, 0, 0},
       -width,
       {width, depth / 2 - 1, 1.4},
       Box({width, -t, 0}, {width + t, depth + t, height}));
  wall("south", {0, 1, 0}, 0, {width / 2, 0, 1.4}, Box({-t, -t, 0}, {width + t, 0, height}));
  wall("north",
       {0, -1, 0},
       -depth,
       {width / 2 - 1, depth, 1.4},
       Box({-t, depth, 0}, {width + t, depth + t, height}));
  // The corner at (width, depth), cut at 45° at 1.2 m of either wall.
  const Eigen::Vector3d cut = Eigen::Vector3d(-1, -1, 0).normalized();
  const Eigen::Vector3d middle(width - 0.6, depth - 0.6, 1.4);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(M_PI / 4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T.translation() = middle - 0.5 * cut;
  wall("cut", cut, cut.dot(middle), middle, OrientedBox(T, {1.0, 1.7, height}));
  const Eigen::Vector3d table(width * 0.35, depth * 0.35, 0.75);
  room.scene.Add(
      Box(table - Eigen::Vector3d(0.9, 0.6, 0.05), table + Eigen::Vector3d(0.9, 0.6, 0)));
  room.faces.push_back({"table", {{0, 0, 1}, 0.75}, table, true});
  const Eigen::Vector3d at = table + Eigen::Vector3d(-0.35 + 0.35 * place, 0.1, 0);
  room.scene.Add(Box(at - Eigen::Vector3d(0.3, 0.3, 0), at + Eigen::Vector3d(0.3, 0.3, 0.6)));
  room.faces.push_back(
      {"box east", {{1, 0, 0}, at.x() + 0.3}, at + Eigen::Vector3d(0.3, 0, 0.3), true});
  room.faces.push_back(
      {"box north", {{0, 1, 0}, at.y() + 0.3}, at + Eigen::Vector3d(0, 0.3, 0.3), true});
  room.scene.Build();
  return room;
}

// Of one face or of all, by plain EM and with main directions.
struct Errors {
  double sum_deg[2] = {0.0, 0.0};
  int found = 0;  // by both

  void Add(double plain_deg, double with_deg) {
    sum_deg[0] += plain_deg;
    sum_deg[1] += with_deg;
    ++found;
  }
  double Mean(int d) const { return found > 0 ? sum_deg[d] / found : 0.0; }
};

// Of each face the found plane that is nearest to it.
std::vector<double> FaceErrors(const PlaneModel& model,
                               const Room& room,
                               const Pose& T_sensor_world) {
  std::vector<double> errors;
  for (const Face& face : room.faces) {
    const Eigen::Vector3d normal = T_sensor_world.linear() * face.plane.normal;
    const Eigen::Vector3d centre = T_sensor_world * face.centre;
    double best = -1.0;
    for (const ModelPlane& plane : model.planes) {
      const double angle = AngleDeg(plane.plane.normal, normal);
      if (angle > 15.0 || Distance(centre, plane.plane) > 0.1) continue;
      if (best < 0.0 || angle < best) best = angle;
    }
    errors.push_back(best);
  }
  return errors;
}

PosedPoints PointsOf(const PointCloud& cloud) {
  PosedPoints points;
  points.points = cloud.points;
  points.views = {{Eigen::Vector3f::Zero(), points.points.size()}};
  return points;
}

SensorOptions RoomSensor() {
  SensorOptions sensor;
  sensor.rings = 60;
  sensor.columns = 360;
  sensor.elevation_min_rad = -1.0;
  sensor.elevation_max_rad = 0.8;
  sensor.sigma_m = 0.015;
  sensor.min_range_m = 0.3;
  return sensor;
}

// Ten rooms with the box at one place of the table.
struct Situation {
  std::map<std::string, Errors> faces;
  Errors all, small;
  int better = 0;            // rooms
  int found[2] = {0, 0};     // faces
  double worse_deg = -90.0;  // of a face, with directions, at most
  double worst_deg = 0.0;    // with directions

  void AddRoom(const Room& room, const std::vector<double> (&errors)[2]) {
    Errors sum;
    for (std::size_t f = 0; f < room.faces.size(); ++f) {
      const double plain = errors[0][f], with = errors[1][f];
      found[0] += plain >= 0.0 ? 1 : 0;
      found[1] += with >= 0.0 ? 1 : 0;
      if (plain < 0.0 || with < 0.0) continue;
      faces[room.faces[f].name].Add(plain, with);
      if (room.faces[f].small) small.Add(plain, with);
      all.Add(plain, with);
      sum.Add(plain, with);
      worse_deg = std::max(worse_deg, with - plain);
      worst_deg = std::max(worst_deg, with);
    }
    better += sum.sum_deg[1] < sum.sum_deg[0] ? 1 : 0;
  }
};

Situation RunSituation(int place, std::uint64_t seed) {
  Situation situation;
  for (int i = 0; i < kWorlds; ++i) {
    const std::uint64_t own = seed + static_cast<std::uint64_t>(kWorlds * place + i);
    Random random(own);
    const Room room = DrawRoom(random, place);
    const double yaw = random.Uniform(-3.0, 3.0);
    const Eigen::Vector3d table = room.faces[7].centre;
    const Pose T_world_sensor =
        MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())),
                 {table.x() + 1.3, table.y() + 1.3, 1.5});
    const PosedPoints points =
        PointsOf(SimulateScan(room.scene, RoomSensor(), T_world_sensor, own + 100));
    std::vector<double> errors[2];
    for (const bool directions : {false, true}) {
      PlaneModelOptions options;
      options.directions = directions;
      options.min_area_m2 = 0.05;
      const PlaneModel model = OrDie(FindPlaneModel(points, options, Stop()));
      errors[directions ? 1 : 0] = FaceErrors(model, room, T_world_sensor.inverse());
    }
    situation.AddRoom(room, errors);
  }
  return situation;
}

// Bounds are those of the thesis' table, in each situation.
int Rooms(std::uint64_t seed) {
  static constexpr int kSituations = 3;
  std::vector<Situation> all;
  for (int place = 0; place < kSituations; ++place) all.push_back(RunSituation(place, seed));
  std::printf(
      "normals' errors in degrees, mean of %d rooms, with the box at three places of the table: "
      "plain EM -> with main directions\n",
      kWorlds);
  for (const auto& [name, first] : all[0].faces) {
    std::printf("%-10s", name.c_str());
    for (Situation& one : all) {
      const Errors& row = one.faces[name];
      std::printf("  %7.3f -> %5.3f", row.Mean(0), row.Mean(1));
    }
    std::printf("\n");
  }
  bool small = true, better = true, none_worse = true, found = true;
  for (const Situation& one : all) {
    std::printf(
        "found %d and %d of 100 faces, sums %.2f and %.2f, of table and box %.2f and %.2f; better "
        "in %d of %d rooms; worst %.2f, worse by %.2f at most\n",
        one.found[0],
        one.found[1],
        one.all.sum_deg[0],
        one.all.sum_deg[1],
        one.small.sum_deg[0],
        one.small.sum_deg[1],
        one.better,
        kWorlds,
        one.worst_deg,
        one.worse_deg);
    small &= one.small.sum_deg[1] <= 0.6 * one.small.sum_deg[0];
    better &= one.better >= 8;
    none_worse &= one.worse_deg <= 1.4;
    found &= one.found[1] >= 90;
  }
  Expect(better, "main directions lower the sum of errors in 8 of 10 rooms");
  Expect(small, "faces of table and box: 40 % less (thesis: 48 to 60 %)");
  Expect(none_worse, "no face is worse by more than 1.4 degrees");
  Expect(found, "9 of 10 faces are found");
  return failures;
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "rooms";
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const std::map<std::string, void (*)(std::uint64_t)> figures = {
      {"walls", strata::testing::ParallelWalls},
      {"rack", strata::testing::Rack},
      {"boxes", strata::testing::Boxes},
      {"carpet", strata::testing::Carpet},
      {"jacket", strata::testing::Jacket},
      {"corridor", strata::testing::Corridor},
      {"thin", strata::testing::ThinWalls}};
  if (const auto figure = figures.find(what); figure != figures.end()) {
    figure->second(seed);
    return strata::testing::failures > 0 ? 1 : 0;
  }
  if (what == "rooms") return strata::testing::Rooms(seed) > 0 ? 1 : 0;
  if (what == "building") return strata::testing::RecordedBuilding();
  if (what == "hall") return strata::testing::RecordedHall();
  return strata::testing::Recording(what);
}
