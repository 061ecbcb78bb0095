// Plane models (thesis 5.3 to 5.5) on drawn rooms and recorded buildings: exits 1 where a bound
// does not hold, 77 where recorded data are absent.
//
// Usage: plane_models rooms|walls|rack|boxes|carpet|jacket|corridor|thin [seed]
//        plane_models building|FOLDER   (a recording with scans and reference poses)
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/common/stop.h"
#include "core/geometry/primitives.h"
#include "core/planes/models/plane_model_finder.h"
#include "core/planes/moments.h"
#include "core/world/plane_model.h"
#include "tests/experiments/meshes/mesh_cases.h"
#include "tests/experiments/planes/plane_cases.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"

namespace strata::testing {
namespace {

constexpr int kNoData = 77;
constexpr int kSmallSegment = 200;  // points

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

struct Errors {
  double sum_deg = 0.0, small_deg = 0.0, worst_deg = 0.0;
  int found = 0, small_found = 0;
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

void Print(const PlaneModel& model, std::size_t most) {
  for (std::size_t m = 0; m < std::min(most, model.planes.size()); ++m) {
    const ModelPlane& p = model.planes[m];
    std::size_t corners = 0, holes = 0;
    double area = 0.0;
    for (const PlanePolygon& polygon : p.polygons) {
      corners += polygon.outer.size();
      holes += polygon.holes.size();
      area += polygon.area_m2;
    }
    std::printf(
        "%3d n %6.3f %6.3f %6.3f d %8.3f dir %2d area %6.1f rms %.3f: %zu pieces, %.1f m2, %zu "
        "corners, %zu holes\n",
        static_cast<int>(p.id),
        p.plane.normal.x(),
        p.plane.normal.y(),
        p.plane.normal.z(),
        p.plane.distance,
        static_cast<int>(p.direction),
        p.area_m2,
        p.rms_m,
        p.polygons.size(),
        area,
        corners,
        holes);
  }
  for (const MainDirection& d : model.directions) {
    std::printf("direction %6.3f %6.3f %6.3f planes %u sigma %.4f\n",
                d.direction.x(),
                d.direction.y(),
                d.direction.z(),
                d.planes,
                d.sigma_rad);
  }
}

int Rooms(std::uint64_t seed) {
  SensorOptions sensor;
  sensor.rings = 60;
  sensor.columns = 360;
  sensor.elevation_min_rad = -1.0;
  sensor.elevation_max_rad = 0.8;
  sensor.sigma_m = 0.015;
  sensor.min_range_m = 0.3;
  std::map<std::string, Errors> table[2];
  Errors all[2];
  int better = 0, worlds = 0;
  std::vector<double> worse_deg;
  for (int i = 0; i < 10; ++i) {
    Random random(seed + static_cast<std::uint64_t>(i));
    const Room room = DrawRoom(random, i % 3);
    const double yaw = random.Uniform(-3.0, 3.0);
    const Pose T_world_sensor =
        MakePose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())),
                 {room.faces[7].centre.x() + 1.3, room.faces[7].centre.y() + 1.3, 1.5});
    const PosedPoints points =
        PointsOf(SimulateScan(room.scene, sensor, T_world_sensor, seed + 100 + i));
    std::vector<double> errors[2];
    for (const bool directions : {false, true}) {
      PlaneModelOptions options;
      options.directions = directions;
      options.min_area_m2 = 0.05;
      const PlaneModel model = OrDie(FindPlaneModel(points, options, Stop()));
      errors[directions ? 1 : 0] = FaceErrors(model, room, T_world_sensor.inverse());
    }
    double sums[2] = {0.0, 0.0};
    for (std::size_t f = 0; f < room.faces.size(); ++f) {
      if (errors[0][f] < 0.0 || errors[1][f] < 0.0) continue;
      worse_deg.push_back(errors[1][f] - errors[0][f]);
      for (const int d : {0, 1}) {
        Errors& row = table[d][room.faces[f].name];
        row.sum_deg += errors[d][f];
        ++row.found;
        sums[d] += errors[d][f];
        if (!room.faces[f].small) continue;
        all[d].small_deg += errors[d][f];
        ++all[d].small_found;
      }
    }
    for (const int d : {0, 1}) {
      all[d].found += static_cast<int>(
          std::count_if(errors[d].begin(), errors[d].end(), [](double e) { return e >= 0.0; }));
      all[d].sum_deg += sums[d];
    }
    ++worlds;
    better += sums[1] < sums[0] ? 1 : 0;
  }
  std::printf(
      "normals' errors in degrees, mean of %d rooms, seed %d: plain EM, with main directions\n",
      worlds,
      static_cast<int>(seed));
  for (const auto& [name, row] : table[0]) {
    const Errors& with = table[1].at(name);
    std::printf("%-10s %2d found  %7.3f  %7.3f\n",
                name.c_str(),
                row.found,
                row.sum_deg / row.found,
                with.sum_deg / with.found);
  }
  std::printf(
      "all: %d and %d of 100 found, sums %.2f and %.2f; small faces %.2f and %.2f; better in %d of "
      "%d rooms\n",
      all[0].found,
      all[1].found,
      all[0].sum_deg,
      all[1].sum_deg,
      all[0].small_deg,
      all[1].small_deg,
      better,
      worlds);
  Expect(better >= 8, "main directions lower the sum of errors in 8 of 10 rooms");
  Expect(all[1].small_deg <= 0.6 * all[0].small_deg, "faces of table and box: 40 % less");
  Expect(*std::max_element(worse_deg.begin(), worse_deg.end()) <= 1.4,
         "no face is worse by more than 1.4 degrees");
  Expect(all[1].found >= 90, "9 of 10 faces are found");
  return failures;
}

// ---- recorded ----

struct Labelled {
  PosedPoints points;
  std::vector<int> segments;
  std::vector<Eigen::Vector3d> normals;
};

Labelled ReadBuilding(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::size_t count = 0;
  while (std::getline(in, line) && line != "end_header") {
    if (line.rfind("element vertex ", 0) == 0) count = std::stoul(line.substr(15));
  }
  Labelled out;
  for (; count > 0; --count) {
    Eigen::Vector3d p, n;
    int segment = -1;
    in >> p.x() >> p.y() >> p.z() >> n.x() >> n.y() >> n.z() >> segment;
    out.points.points.push_back(p.cast<float>());
    out.normals.push_back(n);
    out.segments.push_back(segment);
  }
  // Nobody says where the sensor stood; none was inside.
  out.points.views = {{Eigen::Vector3f(100.0F, 100.0F, 10.0F), out.points.points.size()}};
  return out;
}

PlaneModel Find(const PosedPoints& points, const PlaneModelOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  PlaneModel model = OrDie(FindPlaneModel(points, options, Stop()));
  std::printf("%zu points, %zu planes, %zu directions in %.2f s\n",
              points.points.size(),
              model.planes.size(),
              model.directions.size(),
              std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  return model;
}

int Building() {
  const auto folder = FindData("cgal_building_planes");
  if (!folder.has_value()) return kNoData;
  const Labelled building = ReadBuilding(*folder / "building.ply");
  PlaneModelOptions options;
  options.min_area_m2 = 0.1;
  const PlaneModel model = Find(building.points, options);
  Print(model, 12);
  struct Segment {
    Eigen::Matrix4d moments = Eigen::Matrix4d::Zero();
    std::map<std::size_t, int> on;  // points by plane
    int count = 0;
  };
  std::map<int, Segment> segments;
  std::map<std::size_t, std::map<int, int>> of_plane;
  std::vector<std::size_t> nearest(building.segments.size());
  int right = 0, labelled = 0;
  for (std::size_t i = 0; i < building.segments.size(); ++i) {
    const Eigen::Vector3d p = building.points.points[i].cast<double>();
    double best = 0.3;
    nearest[i] = model.planes.size();
    for (std::size_t m = 0; m < model.planes.size(); ++m) {
      const double off = Distance(p, model.planes[m].plane);
      if (off >= best || AngleDeg(model.planes[m].plane.normal, building.normals[i]) > 30.0)
        continue;
      best = off;
      nearest[i] = m;
    }
    const int s = building.segments[i];
    if (s < 0) continue;
    ++labelled;
    Segment& segment = segments[s];
    segment.moments += MomentsOf(1.0, p, Eigen::Matrix3d::Zero());
    ++segment.count;
    ++segment.on[nearest[i]];
    ++of_plane[nearest[i]][s];
  }
  for (const auto& [m, counts] : of_plane) {
    if (m == model.planes.size()) continue;
    int most = 0;
    for (const auto& [s, count] : counts) most = std::max(most, count);
    right += most;
  }
  int found = 0, large = 0, large_found = 0;
  std::vector<double> angles;
  for (const auto& [s, segment] : segments) {
    const MomentsFit fit = FitMoments(segment.moments);
    double share = 0.0, angle = 90.0;
    for (const auto& [m, count] : segment.on) {
      if (m == model.planes.size() || count <= share * segment.count) continue;
      share = static_cast<double>(count) / segment.count;
      angle = AngleDeg(model.planes[m].plane.normal, fit.plane.normal);
    }
    std::printf("segment %2d: %6d points, rms %.3f, largest share %.2f, angle %.2f deg\n",
                s,
                segment.count,
                std::sqrt(fit.eigenvalues(0)),
                share,
                angle);
    angles.push_back(angle);
    if (angle < 5.0) ++found;
    if (segment.count < kSmallSegment) continue;
    ++large;
    if (angle < 5.0) ++large_found;
  }
  std::sort(angles.begin(), angles.end());
  std::printf("%d of %zu segments, median angle %.2f deg, %.1f %% of points right\n",
              found,
              segments.size(),
              angles[angles.size() / 2],
              100.0 * right / labelled);
  // Wished for: 17 of 19. The others are 18 to 135 points, less than half a square metre.
  Expect(large_found == large, "all segments of 200 points or more");
  Expect(angles[angles.size() / 2] < 1.0, "median error of normals below 1 degree");
  Expect(right >= 0.9 * labelled, "90 % of the points are right");
  return failures;
}

int Hall(const std::string& folder) {
  const auto found = FindData(folder);
  if (!found.has_value()) return kNoData;
  const auto poses = OrDie(ReadIndexedPoses(*found / "poses_reference.txt"));
  PosedPoints points;
  for (const auto& [index, file] : ListScans(*found / "scans")) {
    const PointCloud cloud = OrDie(ReadBinaryPcd(file));
    const Pose& T = poses.at(index).T_world_scan;
    if (points.points.empty()) points.origin = T.translation();
    for (const Eigen::Vector3f& p : cloud.points) {
      points.points.push_back(
          (T * (cloud.origin + p.cast<double>()) - points.origin).cast<float>());
    }
    points.views.push_back(
        {(T * (cloud.origin + cloud.sensor_origin.cast<double>()) - points.origin).cast<float>(),
         points.points.size()});
  }
  const PlaneModel model = Find(points, {});
  Print(model, 40);
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
  if (what == "building") return strata::testing::Building();
  return strata::testing::Hall(what);
}
