// Robots in simulated worlds, with noisy odometry or frames of their own: where ingest puts their
// scans.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

class WorldAlignmentTest : public EngineTest, public ::testing::WithParamInterface<int> {
 protected:
  // Uploads a robot's scans with its odometry and returns the exact poses.
  std::vector<Pose> Record(const World& world, const Robot& robot, std::uint64_t seed) {
    const std::vector<Pose> truth = Drive(world.scene, robot.waypoints, 1.5, 1.2);
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

class LinksTest : public EngineTest {
 protected:
  // Uploads what a robot sees at these poses as being at said(pose), and waits.
  void Record(const Scene& scene,
              const std::string& robot,
              const std::vector<Pose>& truth,
              const std::function<Pose(const Pose&)>& said,
              const std::string& map = kMapName) {
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const PointCloud cloud = SimulateScan(scene, {}, truth[i], i + 100 * robot.size());
      STRATA_ASSERT_OK(Upload(
          db(), HeaderOf({robot, i}, cloud, said(truth[i]), Alignment::kOn), cloud, 40'000, map));
    }
    ASSERT_EQ(WaitIntegrated(db(), map).scans_failed, 0U);
  }
  std::vector<Pose> PosesOf(const std::string& robot, const std::string& map = kMapName) {
    std::vector<Pose> poses;
    const auto graph = db().posegraph().Get({}, map);
    STRATA_EXPECT_OK(graph.status());
    for (const PoseNode& node : graph->nodes) {
      if (node.id.trajectory == robot) poses.push_back(node.T_map_scan);
    }
    return poses;
  }
  static double Farthest(const std::vector<Pose>& poses, const std::vector<Pose>& truth) {
    EXPECT_EQ(poses.size(), truth.size());
    double farthest = 0.0;
    for (std::size_t i = 0; i < poses.size() && i < truth.size(); ++i) {
      farthest = std::max(farthest, (poses[i].translation() - truth[i].translation()).norm());
    }
    return farthest;
  }
  static Pose Same(const Pose& T) { return T; }

  const Scene yard_ = YardScene();
  const std::vector<Pose> way_ = Drive(yard_, {{-8, 0, 0}, {8, 0, 0}}, 1.0, 1.2);
};

TEST_F(LinksTest, ASecondRobotWhoseFrameIsOffByMetresBecomesNoGhost) {
  MakeMap(MapParameters());
  Record(yard_, "first", way_, Same);
  const Pose off = way_[0] * PoseAt(2.0, -2.0, 0.25) * way_[0].inverse();
  Record(yard_, "second", way_, [&](const Pose& T) { return off * T; });
  EXPECT_LT(Farthest(PosesOf("second"), way_), 0.05);
}

TEST_F(LinksTest, ARobotThatIsNotWhereItSaysIsLinkedToNothing) {
  MakeMap(MapParameters());
  Record(yard_, "first", way_, Same);
  const Pose off = PoseAt(0.0, 25.0, 1.5);
  Record(yard_, "second", way_, [&](const Pose& T) { return off * T; });
  std::vector<Pose> said;
  for (const Pose& T : way_) said.push_back(off * T);
  EXPECT_LT(Farthest(PosesOf("second"), said), 0.1);
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo info, db().scans().Get({}, kMapName, {"second", 0}));
  EXPECT_FALSE(info.alignment.aligned);
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseGraphState graph, db().posegraph().Get({}, kMapName));
  for (const Constraint& c : graph.constraints) EXPECT_EQ(c.i.trajectory, c.j.trajectory);
}

// Its first scan fits there, by half of what it shows.
TEST_F(LinksTest, ARobotThatStartsBesideWhereItSaysIsLinkedToNothingThere) {
  MakeMap(MapParameters());
  Record(yard_, "first", way_, Same);
  const std::vector<Pose> start(way_.begin() + 4, way_.begin() + 7);
  const Pose off = PoseAt(0.0, 5.4, 0.0);
  Record(yard_, "second", start, [&](const Pose& T) { return off * T; });
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo info, db().scans().Get({}, kMapName, {"second", 0}));
  EXPECT_FALSE(info.alignment.aligned) << info.alignment.message;
}

TEST_F(LinksTest, MotionThatIsWrongByMetresIsMendedByWhatTheScansShow) {
  MakeMap(MapParameters());
  Random random(3);
  Record(yard_, "shaken", way_, [&](const Pose& T) {
    if (T.isApprox(way_[0])) return T;
    return Pose(T * PoseAt(random.Gaussian(), random.Gaussian(), 0.09 * random.Gaussian()));
  });
  EXPECT_LT(Farthest(PosesOf("shaken"), way_), 0.05);
}

// How it lies to what was before nobody knows, but its own scans say how they lie to each other;
// the server may end in between.
TEST_F(LinksTest, AfterAJumpThatNothingMendsScansAreTiedToEachOther) {
  MakeMap(MapParameters());
  const std::size_t jump = way_.size() / 2;
  Random random(5);
  std::vector<Pose> said = way_;
  for (std::size_t i = jump; i < said.size(); ++i) {
    const double x = 0.1 * random.Gaussian();
    const double y = 0.1 * random.Gaussian();
    said[i] = PoseAt(1.0, 7.0, 0.3) * way_[i] * PoseAt(x, y, 0.02 * random.Gaussian());
  }
  for (std::size_t i = 0; i < way_.size(); ++i) {
    if (i == jump + 2) {
      Close();
      Reopen();
    }
    const PointCloud cloud = SimulateScan(yard_, {}, way_[i], 700 + i);
    const ScanHeader header = HeaderOf({"jumps", i}, cloud, said[i], Alignment::kOn);
    STRATA_ASSERT_OK(Upload(db(), header, cloud, 40'000));
    ASSERT_EQ(WaitIntegrated(db()).scans_failed, 0U);
    STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo info, db().scans().Get({}, kMapName, header.id));
    EXPECT_EQ(info.alignment.aligned, i != 0 && i != jump) << i << ": " << info.alignment.message;
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseGraphState graph, db().posegraph().Get({}, kMapName));
  for (const Constraint& c : graph.constraints) {
    EXPECT_EQ(c.i.sequence < jump, c.j.sequence < jump) << c.i.ToString() << c.j.ToString();
  }
  const std::vector<Pose> poses = PosesOf("jumps");
  for (std::size_t i = jump + 1; i < way_.size(); ++i) {
    const Pose is = poses[jump].inverse() * poses[i];
    const Pose truth = way_[jump].inverse() * way_[i];
    EXPECT_LT((is.translation() - truth.translation()).norm(), 0.05) << i;
  }
}

// Two jumps one after the other: what is seen after them lies to the scan before as it was
// measured, and says nothing of the one between.
TEST_F(LinksTest, ScansThatAreLostAreNoOnePiece) {
  MakeMap(MapParameters());
  const std::size_t jump = way_.size() / 2;
  Record(yard_, "jumps", way_, [&](const Pose& T) {
    const double x = T.translation().x();
    if (x < way_[jump].translation().x() - 0.1) return T;
    if (x < way_[jump + 1].translation().x() - 0.1) return PoseAt(1.0, 7.0, 0.3) * T;
    return PoseAt(4.0, 16.0, -0.4) * T;
  });
  STRATA_ASSERT_OK_AND_ASSIGN(const api::PoseGraphState graph, db().posegraph().Get({}, kMapName));
  for (const Constraint& c : graph.constraints) {
    EXPECT_NE(c.i.sequence, jump) << c.j.ToString();
    EXPECT_NE(c.j.sequence, jump) << c.i.ToString();
    EXPECT_EQ(c.i.sequence < jump, c.j.sequence < jump) << c.i.ToString() << c.j.ToString();
  }
  STRATA_ASSERT_OK_AND_ASSIGN(const ScanInfo info,
                              db().scans().Get({}, kMapName, {"jumps", jump + 2}));
  EXPECT_TRUE(info.alignment.aligned) << info.alignment.message;
}

TEST_F(LinksTest, CellsOfTheMapDoNotChangeWhereScansAre) {
  MapParameters coarse;
  coarse.mls.cell_size_m = 0.5;
  MakeMap(MapParameters());
  MakeMap(coarse, "coarse");
  for (const std::string map : {kMapName, "coarse"}) Record(yard_, "robot", way_, Same, map);
  const std::vector<Pose> fine = PosesOf("robot");
  const std::vector<Pose> same = PosesOf("robot", "coarse");
  ASSERT_EQ(fine.size(), same.size());
  for (std::size_t i = 0; i < fine.size(); ++i) EXPECT_TRUE(fine[i].isApprox(same[i], 0.0)) << i;
}

// Mean height above the truth of those scans that were taken above `z_m`.
double MeanRise(const std::vector<Pose>& poses, const std::vector<Pose>& truth, double z_m) {
  double sum = 0.0;
  int above = 0;
  for (std::size_t i = 0; i < poses.size() && i < truth.size(); ++i) {
    if (truth[i].translation().z() < z_m) continue;
    sum += poses[i].translation().z() - truth[i].translation().z();
    ++above;
  }
  EXPECT_GT(above, 15);
  return sum / std::max(above, 1);
}

// Its underside is as near to an upper storey's scans as its top, and the rim of the slab, seen
// from below, ends at the last beam that meets it: as a border of the top that pulled it down by
// 0.07 m.
TEST_F(LinksTest, AnUpperStoreyStaysWhereItIs) {
  const World world = CarParkWorld(0.25);
  const std::vector<Pose> truth = Drive(world.scene, world.loops[0].waypoints, 6.0, 1.1);
  MakeMap(MapParameters());
  Record(world.scene, "loop", truth, Same);
  EXPECT_LT(std::abs(MeanRise(PosesOf("loop"), truth, 4.0)), 0.03);
  ASSERT_EQ(RunJob(db(), "optimize").state, JobState::kSucceeded);
  EXPECT_LT(std::abs(MeanRise(PosesOf("loop"), truth, 4.0)), 0.03);
}

}  // namespace
}  // namespace strata::testing
