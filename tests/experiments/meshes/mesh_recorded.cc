// Tables of mesh_methods on recorded scans.
#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "core/common/stop.h"
#include "core/mesh/density_contour.h"
#include "core/mesh/distance_field.h"
#include "core/mesh/mesh_check.h"
#include "core/mesh/point_thinner.h"
#include "core/mesh/triangle_mesh.h"
#include "core/mls/build.h"
#include "tests/experiments/meshes/mesh_cases.h"
#include "tests/experiments/meshes/stool.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"

namespace strata::testing {
namespace {

std::vector<StoolView> Recorded(const std::string& folder) {
  std::vector<StoolView> scans;
  const auto found = FindData(folder);
  if (!found.has_value()) {
    std::printf("no recorded data: set STRATA_DATA to a folder that holds %s\n", folder.c_str());
    return scans;
  }
  const auto poses = OrDie(ReadIndexedPoses(*found / "poses_reference.txt"));
  for (const auto& [index, file] : ListScans(*found / "scans")) {
    scans.push_back({OrDie(ReadBinaryPcd(file)), poses.at(index).T_world_scan});
  }
  return scans;
}

void PrintBytes(const char* name, const char* thesis, double bytes, std::size_t points) {
  std::printf("%-34s %9.1f MB %7.1f B a point  %s\n",
              name,
              1e-6 * bytes,
              bytes / static_cast<double>(points),
              thesis);
}

}  // namespace

void RunMemory() {
  constexpr double kEdgeM = 0.2;
  const std::vector<StoolView> scans = Recorded("nclt_campus_loop");
  if (scans.empty()) return;
  DistanceField field({.voxel_m = kEdgeM});
  Eigen::AlignedBox3d box;
  PlacesView view;
  MlsParameters parameters;
  parameters.cell_size_m = kEdgeM;
  std::size_t patches = 0;
  for (const StoolView& scan : scans) {
    OrDie(field.Add(scan.cloud, scan.T_world_scan, SensorModel(), Stop()));
    patches += OrDie(BuildMlsMap(scan.cloud, scan.T_world_scan, SensorModel(), parameters))
                   .map.patch_count();
    for (const Eigen::Vector3f& p : scan.cloud.points) {
      view.points.push_back(scan.T_world_scan * p.cast<double>());
      box.extend(view.points.back());
    }
  }
  PlacesTree tree(3, view, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  const TriangleMesh mesh = OrDie(field.Mesh(Stop()));
  const std::size_t n = view.points.size();
  std::printf("%zu scans, %zu points, %.0f × %.0f × %.0f m, cells of %g m\n",
              scans.size(),
              n,
              box.sizes().x(),
              box.sizes().y(),
              box.sizes().z(),
              kEdgeM);
  PrintBytes("point cloud, floats", "O(n)", 12.0 * static_cast<double>(n), n);
  PrintBytes("kd-tree over it", "O(n)", static_cast<double>(tree.usedMemory(tree)), n);
  PrintBytes("occupancy grid, a byte a cell", "O(w·d·h)", (box.sizes() / kEdgeM).prod(), n);
  PrintBytes("distance over blocks", "-", static_cast<double>(field.bytes()), n);
  PrintBytes("mesh of it",
             "O(w·d·h) or O(n)",
             static_cast<double>(24 * mesh.vertices.size() + 12 * mesh.triangles.size()),
             n);
  PrintBytes("patches of all scans, before joins", "-", 24.0 * static_cast<double>(patches), n);
}

void RunRecorded() {
  struct Case {
    const char* folder;
    double voxel_m;
    double most_s;
  };
  for (const Case& c : {Case{"eth_facade_tls", 0.1, 20.0}, Case{"hall_livox_loop", 0.05, 60.0}}) {
    const std::vector<StoolView> scans = Recorded(c.folder);
    if (scans.empty()) continue;
    std::size_t points = 0;
    for (const StoolView& scan : scans) points += scan.cloud.size();
    std::printf(
        "\n%s: %zu scans, %zu points, voxels of %g m\n", c.folder, scans.size(), points, c.voxel_m);
    DistanceField field({.voxel_m = c.voxel_m});
    TriangleMesh mesh;
    const double seconds = Seconds([&] {
      for (const auto& s : scans) OrDie(field.Add(s.cloud, s.T_world_scan, SensorModel(), Stop()));
      for (const auto& s : scans)
        OrDie(field.Carve(s.cloud, s.T_world_scan, SensorModel(), Stop()));
      mesh = OrDie(field.Mesh(Stop()));
    });
    const MeshCheck check = CheckMesh(mesh);
    std::printf(
        "tsdf     %6.1f s  %8zu triangles  %7.0f m²  %zu edges of borders, %zu not manifold, %zu "
        "MiB of voxels\n",
        seconds,
        mesh.triangles.size(),
        AreaOf(mesh),
        check.boundary_edges,
        check.nonmanifold_edges,
        field.bytes() >> 20);
    Expect(seconds <= c.most_s, std::string(c.folder) + ": tsdf within its seconds");
    Expect(check.manifold(), std::string(c.folder) + ": tsdf is manifold");
    PointThinner thinner({.edge_m = c.voxel_m / 2.0});
    for (const auto& s : scans) OrDie(thinner.Add(s.cloud, s.T_world_scan, SensorModel(), Stop()));
    DensityContourOptions contour;
    contour.voxel_m = c.voxel_m;
    const double contour_s =
        Seconds([&] { mesh = OrDie(ContourDensity(thinner.Points().points, contour, Stop())); });
    std::printf("contour  %6.1f s  %8zu triangles  %7.0f m²\n",
                contour_s,
                mesh.triangles.size(),
                AreaOf(mesh));
    Expect(CheckMesh(mesh).closed(), std::string(c.folder) + ": contour is closed");
  }
}

}  // namespace strata::testing
