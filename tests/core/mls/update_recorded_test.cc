// Map update (thesis 6.5.3) against map creation (6.5.2) on recorded drives: ≥ 99 % of the means
// within 1 σ, patch counts within 1 %.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>

#include <gtest/gtest.h>

#include "core/mls/build.h"
#include "core/mls/join.h"
#include "core/mls/update.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"
#include "tests/support/status_matchers.h"

namespace strata {
namespace {

// Both ways of making the map of a drive.
struct Maps {
  MlsMap created;
  MlsUpdater updated;
};

// The measurements as an updater's user would make them, in plain double precision.
void Update(const PointCloud& cloud, const Pose& T_map_scan, MlsUpdater& updater) {
  const SensorModel sensor;
  for (const Eigen::Vector3f& p : cloud.points) {
    updater.Update(T_map_scan * p.cast<double>(), sensor.SigmaAt(p.cast<double>().norm()));
  }
}

void MapDrive(const std::filesystem::path& scans,
              const std::filesystem::path& poses_file,
              std::size_t count,
              Maps& maps) {
  STRATA_ASSERT_OK_AND_ASSIGN(const auto poses, testing::ReadIndexedPoses(poses_file));
  for (const auto& [index, file] : testing::ListScans(scans)) {
    if (count-- == 0) break;
    ASSERT_TRUE(poses.contains(index)) << index;
    const Pose& T_map_scan = poses.at(index).T_world_scan;
    STRATA_ASSERT_OK_AND_ASSIGN(const PointCloud cloud, testing::ReadBinaryPcd(file));
    STRATA_ASSERT_OK_AND_ASSIGN(
        const MlsBuildResult built,
        BuildMlsMap(cloud, T_map_scan, SensorModel(), maps.created.parameters));
    JoinInto(maps.created, built.map);
    Update(cloud, T_map_scan, maps.updated);
  }
}

// Of the patches of `a`, how many have one in the same cell of `b` whose mean is within 1 σ.
template <typename CellOfB>
double ShareWithin1Sigma(const MlsMap& a, CellOfB cell_of_b) {
  std::size_t within = 0;
  for (const MlsTile& tile : a.tiles) {
    for (const Patch& patch : tile.patches) {
      const auto cell = CellOf(tile.key, static_cast<std::uint16_t>(patch.cell));
      const auto others = cell_of_b(cell);
      within += std::any_of(others.begin(), others.end(), [&patch](const Patch& other) {
        return std::abs(other.mean_m() - patch.mean_m()) <= patch.sigma_m();
      });
    }
  }
  return static_cast<double>(within) / static_cast<double>(a.patch_count());
}

void ExpectAgreement(const Maps& maps) {
  const MlsMap closed = maps.updated.Map();
  const auto created = static_cast<double>(maps.created.patch_count());
  ASSERT_GT(created, 10'000);
  const double there = ShareWithin1Sigma(
      maps.created, [&closed](const CellIndex& cell) { return closed.Cell(cell); });
  const double back =
      ShareWithin1Sigma(closed, [&maps](const CellIndex& cell) { return maps.created.Cell(cell); });
  EXPECT_GE(there, 0.99);
  EXPECT_GE(back, 0.99);
  EXPECT_NEAR(static_cast<double>(closed.patch_count()) / created, 1.0, 0.01);
}

class UpdateRecordedTest : public ::testing::TestWithParam<double> {
 protected:
  const MlsParameters parameters_{.cell_size_m = GetParam()};
  Maps maps_{{parameters_, {}}, MlsUpdater(parameters_)};
};

TEST_P(UpdateRecordedTest, AgreesWithCreationOnNclt) {
  STRATA_REQUIRE_DATA(folder, "nclt_campus_loop");
  MapDrive(folder / "scans", folder / "poses_reference.txt", 20, maps_);
  ExpectAgreement(maps_);
}

TEST_P(UpdateRecordedTest, AgreesWithCreationOnKitti) {
  STRATA_REQUIRE_DATA(folder, "kitti_city_drive");
  MapDrive(folder / "scans", folder / "poses_reference_icp.txt", 6, maps_);
  ExpectAgreement(maps_);
}

INSTANTIATE_TEST_SUITE_P(CellSizes,
                         UpdateRecordedTest,
                         ::testing::Values(0.1, 0.3),
                         [](const auto& size) { return size.param < 0.2 ? "Fine" : "Coarse"; });

}  // namespace
}  // namespace strata
