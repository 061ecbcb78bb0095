// Plane models (thesis chapter 5) on drawn rooms and recorded buildings.
//
// plane_models building|hall   exits 1 where a bound does not hold
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/common/stop.h"
#include "core/planes/models/plane_model_finder.h"
#include "core/planes/moments.h"
#include "core/world/plane_model.h"
#include "tests/experiments/mesh_cases.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"
#include "tests/support/simulator.h"

namespace strata::testing {
namespace {

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

void Print(const PlaneModel& model, std::size_t most) {
  for (std::size_t m = 0; m < std::min(most, model.planes.size()); ++m) {
    const ModelPlane& p = model.planes[m];
    std::size_t corners = 0, holes = 0;
    double area = 0;
    for (const PlanePolygon& polygon : p.polygons) {
      corners += polygon.outer.size();
      holes += polygon.holes.size();
      area += polygon.area_m2;
    }
    std::printf(
        "%3d n %6.3f %6.3f %6.3f d %8.3f dir %2d area %7.1f points %8d rms %.3f polygons %zu (%.1f "
        "m2, %zu corners, %zu holes)\n",
        static_cast<int>(p.id),
        p.plane.normal.x(),
        p.plane.normal.y(),
        p.plane.normal.z(),
        p.plane.distance,
        static_cast<int>(p.direction),
        p.area_m2,
        static_cast<int>(p.point_count),
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

PlaneModel Find(const PosedPoints& points, const PlaneModelOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  auto model = FindPlaneModel(points, options, Stop());
  if (!model.ok()) {
    std::printf("%s\n", model.status().ToString().c_str());
    exit(1);
  }
  std::printf("%zu points, %zu planes, %zu directions in %.2f s\n",
              points.points.size(),
              model->planes.size(),
              model->directions.size(),
              std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  return *std::move(model);
}

int Building() {
  const auto folder = FindData("cgal_building_planes");
  if (!folder.has_value()) return 77;
  const Labelled building = ReadBuilding(*folder / "building.ply");
  PlaneModelOptions options;
  if (const char* rho = std::getenv("RHO")) options.rho_m = std::atof(rho);
  if (const char* area = std::getenv("AREA")) options.min_area_m2 = std::atof(area);
  const PlaneModel model = Find(building.points, options);
  Print(model, 60);
  std::map<int, Eigen::Matrix4d> segments;
  std::map<int, std::map<std::size_t, int>> at;
  for (std::size_t i = 0; i < building.segments.size(); ++i) {
    const int s = building.segments[i];
    if (s < 0) continue;
    const Eigen::Vector3d p = building.points.points[i].cast<double>();
    segments.try_emplace(s, Eigen::Matrix4d::Zero()).first->second +=
        MomentsOf(1.0, p, Eigen::Matrix3d::Zero());
  }
  for (const auto& [s, moments] : segments) {
    const MomentsFit fit = FitMoments(moments);
    std::printf("segment %2d n %6.3f %6.3f %6.3f d %8.3f points %6.0f rms %.3f",
                s,
                fit.plane.normal.x(),
                fit.plane.normal.y(),
                fit.plane.normal.z(),
                fit.plane.distance,
                moments(3, 3),
                std::sqrt(fit.eigenvalues(0)));
    int best = -1;
    double share = 0;
    for (std::size_t m = 0; m < model.planes.size(); ++m) {
      if (std::abs(model.planes[m].plane.normal.dot(fit.plane.normal)) < 0.985) continue;
      double near = 0, all = 0;
      for (std::size_t i = 0; i < building.segments.size(); ++i) {
        if (building.segments[i] != s) continue;
        ++all;
        near +=
            Distance(building.points.points[i].cast<double>().eval(), model.planes[m].plane) < 0.15;
      }
      if (near / all > share) {
        share = near / all;
        best = static_cast<int>(m);
      }
    }
    std::printf(
        "   best plane %d share %.2f angle %.2f deg\n",
        best + 1,
        share,
        best < 0 ? -1.0
                 : 57.29578 *
                       std::acos(std::min(
                           1.0, std::abs(model.planes[best].plane.normal.dot(fit.plane.normal)))));
  }
  return 0;
}

int Hall(const char* folder) {
  const auto found = FindData(folder);
  if (!found.has_value()) return 77;
  const auto poses = OrDie(ReadIndexedPoses(*found / "poses_reference.txt"));
  PosedPoints points;
  for (const auto& [index, file] : ListScans(*found / "scans")) {
    const PointCloud cloud = OrDie(ReadBinaryPcd(file));
    const Pose& T = poses.at(index).T_world_scan;
    if (points.points.empty()) points.origin = T.translation();
    for (const Eigen::Vector3f& p : cloud.points)
      points.points.push_back(
          (T * (cloud.origin + p.cast<double>()) - points.origin).cast<float>());
    points.views.push_back(
        {(T * (cloud.origin + cloud.sensor_origin.cast<double>()) - points.origin).cast<float>(),
         points.points.size()});
  }
  const PlaneModel model = Find(points, {});
  Print(model, 40);
  return 0;
}

}  // namespace
}  // namespace strata::testing

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "building";
  return what == "building" ? strata::testing::Building() : strata::testing::Hall(argv[1]);
}
