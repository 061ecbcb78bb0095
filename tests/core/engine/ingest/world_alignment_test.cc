// Two robots with noisy odometry in one simulated world: where ingest puts their scans.
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/simulator.h"
#include "tests/support/status_matchers.h"
#include "tests/support/worlds.h"

namespace strata::testing {
namespace {

class WorldAlignmentTest : public EngineTest, public ::testing::WithParamInterface<int> {
 protected:
  // Uploads a robot's scans with its odometry and returns the exact poses.
  std::vector<Pose> Record(const World& world, const Robot& robot, std::uint64_t seed) {
    const std::vector<Pose> truth = Drive(world.scene, robot.waypoints, 1.0, 1.2);
    const std::vector<Pose> odometry =
        NoisyOdometry(truth, {.translation_sigma_m = 0.02, .rotation_sigma_rad = 0.003}, seed);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const PointCloud cloud = SimulateScan(world.scene, {}, truth[i], seed + i);
      STRATA_EXPECT_OK(Upload(
          db(), HeaderOf({robot.name, i}, cloud, odometry[i], Alignment::kOn), cloud, 40'000));
    }
    return truth;
  }
};

TEST_P(WorldAlignmentTest, UnderABridgeTheGroundIsWhereItIsFromAbove) {
  const World world = BridgeWorld();
  MakeMap(MapParameters());
  std::vector<Pose> truth;
  for (const Robot& robot : world.robots) {
    const std::vector<Pose> driven = Record(world, robot, 1000 * GetParam());
    truth.insert(truth.end(), driven.begin(), driven.end());
  }
  ASSERT_EQ(WaitIntegrated(db()).scans_failed, 0U);
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseGraphState graph, db().posegraph().Get({}, kMapName));
  ASSERT_EQ(graph.nodes.size(), truth.size());
  // Of neighbours, samples and match classes together: without them the lower robot was lifted by
  // up to 0.5 m. The match classes alone are held by mls_registration_test.
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_LT((graph.nodes[i].T_map_scan.translation() - truth[i].translation()).norm(), 0.2)
        << graph.nodes[i].id.ToString();
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, WorldAlignmentTest, ::testing::Values(1, 2));

}  // namespace
}  // namespace strata::testing
