// Files as sensors, programs and people left them.
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/formats/pose_reader.h"
#include "client/formats/scan_list.h"
#include "client/formats/scan_reader.h"
#include "tests/support/data_dir.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

using Voxel = std::tuple<std::int64_t, std::int64_t, std::int64_t>;

// Points of a corridor scan in the map, without the returns its README calls invalid, one a voxel.
std::vector<Eigen::Vector3d> ThinnedInMap(const PointCloud& cloud,
                                          const Pose& T_map_scan,
                                          double voxel_m) {
  std::vector<Eigen::Vector3d> points;
  std::set<Voxel> seen;
  for (const Eigen::Vector3f& point : cloud.points) {
    if (point.norm() > 30.0F || point.norm() < 0.5F) continue;
    const Eigen::Vector3d p = T_map_scan * point.cast<double>();
    const Eigen::Array3d v = (p.array() / voxel_m).floor();
    if (seen.emplace(v.x(), v.y(), v.z()).second) points.push_back(p);
  }
  return points;
}

// Share of `a` with a point of `b` within 0.2 m.
double Overlap(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
  const double gate_m = 0.2;
  std::set<std::pair<Voxel, std::size_t>> grid;
  const auto voxel_of = [gate_m](const Eigen::Vector3d& p) {
    const Eigen::Array3d v = (p.array() / gate_m).floor();
    return Voxel(v.x(), v.y(), v.z());
  };
  for (std::size_t i = 0; i < b.size(); ++i) grid.emplace(voxel_of(b[i]), i);
  const auto has_partner = [&](const Eigen::Vector3d& p) {
    const auto [x, y, z] = voxel_of(p);
    for (int k = 0; k < 27; ++k) {
      const Voxel v(x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1);
      for (auto it = grid.lower_bound({v, 0}); it != grid.end() && it->first == v; ++it) {
        if ((b[it->second] - p).norm() <= gate_m) return true;
      }
    }
    return false;
  };
  std::size_t partners = 0;
  for (const Eigen::Vector3d& p : a) partners += has_partner(p) ? 1 : 0;
  return static_cast<double>(partners) / static_cast<double>(a.size());
}

TEST(RecordedScansTest, CorridorOf3dtkOverlapsByItsPosesOnly) {
  STRATA_REQUIRE_DATA(path, "slam6d_corridor");
  STRATA_ASSERT_OK_AND_ASSIGN(const auto scans,
                              ListScans({path}, {.pose_format = PoseFormat::k3dtk}));
  ASSERT_EQ(scans.size(), 3U);
  std::vector<std::vector<Eigen::Vector3d>> posed;
  std::vector<std::vector<Eigen::Vector3d>> unposed;
  for (const ScanFile& scan : scans) {
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScan(scan.path));
    EXPECT_EQ(cloud.size(), 81'360U);
    posed.push_back(ThinnedInMap(cloud, scan.T_map_scan, 0.1));
    unposed.push_back(ThinnedInMap(cloud, Pose::Identity(), 0.1));
  }
  // The README's 0.79 and 0.82.
  EXPECT_GT(Overlap(posed[1], posed[0]), 0.76);
  EXPECT_GT(Overlap(posed[2], posed[1]), 0.76);
  EXPECT_GT(Overlap(posed[1], posed[0]), Overlap(unposed[1], unposed[0]) + 0.05);
  // x forward: the robot drove ahead, by odometry 1.6 to 1.9 m each time; z up: it stayed level.
  const Eigen::Vector3d drive =
      scans[2].T_map_scan.translation() - scans[0].T_map_scan.translation();
  EXPECT_NEAR(drive.x(), 3.4, 0.2);
  EXPECT_LT(std::abs(drive.z()), 0.3);
}

TEST(RecordedScansTest, UtmFloatsKeepWhatTheyHave) {
  STRATA_REQUIRE_DATA(path, "isprs_als_filter");
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScan(path / "samp71-utm.pcd"));
  EXPECT_EQ(cloud.size(), 15'645U);
  EXPECT_GT(cloud.origin.x(), 400'000.0);
  EXPECT_GT(cloud.origin.y(), 5'000'000.0);
  for (const Eigen::Vector3f& point : cloud.points) {
    // What is a float in the file comes back as that float: y in steps of 0.5 m, x of 1/32 m.
    const Eigen::Vector3d p = cloud.origin + point.cast<double>();
    ASSERT_EQ(p.y() * 2.0, std::floor(p.y() * 2.0));
    ASSERT_EQ(p.x() * 32.0, std::floor(p.x() * 32.0));
    ASSERT_LT(point.head<2>().norm(), 1500.0F);
  }
}

TEST(RecordedScansTest, AStreetInWorldCoordinatesLiesAroundItsOrigin) {
  STRATA_REQUIRE_DATA(path, "lille_facade");
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, ReadScan(path / "Lille_street_small.ply"));
  EXPECT_EQ(cloud.size(), 170'610U);
  EXPECT_NEAR(cloud.origin.x(), -890.0, 30.0);
  EXPECT_NEAR(cloud.origin.y(), -943.0, 30.0);
  for (const Eigen::Vector3f& point : cloud.points) {
    ASSERT_LT((point - cloud.sensor_origin).norm(), 30.0F);
  }
}

TEST(RecordedScansTest, EveryScanOfEverySetReads) {
  STRATA_REQUIRE_DATA(path, "");
  for (const char* folder : {"nclt_campus_loop/scans",
                             "hall_livox_loop/scans",
                             "eth_facade_tls/scans",
                             "kitti_city_drive/scans",
                             "kitti00_gt/velodyne",
                             "isprs_als_filter",
                             "nclt_keyframes",
                             "registration_pairs/small_gicp",
                             "oakland3d",
                             "cgal_building_planes",
                             "lille_facade"}) {
    SCOPED_TRACE(folder);
    if (!std::filesystem::exists(path / folder)) continue;
    STRATA_ASSERT_OK_AND_ASSIGN(const auto scans, ListScans({path / folder}, {.poses = kNoPoses}));
    // All of the small sets, a sample of the large ones.
    for (std::size_t i = 0; i < scans.size(); i += 1 + scans.size() / 20) {
      STRATA_EXPECT_OK(ReadScan(scans[i].path)) << scans[i].path;
    }
  }
}

TEST(RecordedScansTest, SequencesHaveAPoseForEveryScan) {
  STRATA_REQUIRE_DATA(path, "");
  for (const auto& [scans, poses] : std::vector<std::pair<const char*, const char*>>{
           {"nclt_campus_loop/scans", "nclt_campus_loop/poses_reference.txt"},
           {"nclt_campus_loop/scans", "nclt_campus_loop/poses_initial.txt"},
           {"hall_livox_loop/scans", "hall_livox_loop/poses_initial.txt"},
           {"eth_facade_tls/scans", "eth_facade_tls/poses_reference.txt"},
           {"kitti_city_drive/scans", "kitti_city_drive/poses_reference_icp.txt"},
           {"kitti00_gt/velodyne", "kitti00_gt/poses_00_velo.txt"},
           {"kitti00_gt/velodyne", "kitti00_gt/poses_00_cam0.txt"}}) {
    SCOPED_TRACE(poses);
    STRATA_ASSERT_OK_AND_ASSIGN(const auto list,
                                ListScans({path / scans}, {.poses = path / poses}));
    for (const ScanFile& scan : list) STRATA_EXPECT_OK(scan.pose_status) << scan.path;
  }
}

TEST(RecordedScansTest, ColumnsComeWithTheirScans) {
  STRATA_REQUIRE_DATA(path, "");
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud facade,
                              ReadScan(path / "eth_facade_tls/scans/s0.pcd"));
  EXPECT_EQ(facade.colour.size(), 44'728U);
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud autzen,
                              ReadScan(path / "importer_samples/pdal_autzen-utm.pcd"));
  EXPECT_EQ(autzen.size(), 1'065U);
  EXPECT_EQ(autzen.intensity.size(), 1'065U);
  EXPECT_EQ(autzen.label.size(), 1'065U);
  EXPECT_EQ(autzen.colour.size(), 1'065U);
  EXPECT_GT(autzen.origin.norm(), 1e5);
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud oakland,
                              ReadScan(path / "oakland3d/oakland_part3_ap.xyz_label_conf"));
  EXPECT_EQ(oakland.label.size(), oakland.size());
  EXPECT_THAT(oakland.label, ::testing::Contains(1203));
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud kitti,
                              ReadScan(path / "importer_samples/kitti_000008_reduced.bin"));
  EXPECT_EQ(kitti.intensity.size(), 275'808U / 16);
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud vtk,
                              ReadScan(path / "libpointmatcher_scans/cloud.00000.vtk"));
  EXPECT_EQ(vtk.size(), 24'989U);
  STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud building,
                              ReadScan(path / "cgal_building_planes/building.ply"));
  EXPECT_EQ(building.size(), 100'000U);
}

TEST(RecordedScansTest, WhatIsNoScanSaysSo) {
  STRATA_REQUIRE_DATA(path, "importer_samples");
  for (const char* name : {"mrpt_velodyne_VLP16.rawlog"}) {
    EXPECT_THAT(ReadScan(path / name),
                testing::StatusIs(absl::StatusCode::kInvalidArgument,
                                  ::testing::AllOf(::testing::HasSubstr(name),
                                                   ::testing::HasSubstr("not read"))));
    for (const ScanFormat format : {ScanFormat::k3dtk,
                                    ScanFormat::kPcd,
                                    ScanFormat::kPly,
                                    ScanFormat::kVtk,
                                    ScanFormat::kXyz}) {
      EXPECT_EQ(ReadScan(path / name, format).status().code(), absl::StatusCode::kInvalidArgument);
    }
  }
}

}  // namespace
}  // namespace strata
