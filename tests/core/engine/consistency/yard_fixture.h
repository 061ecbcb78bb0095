// A robot on a bow through a simulated yard, in a map of its own: where it was, and where it says
// it was.
#ifndef STRATA_TESTS_CORE_ENGINE_CONSISTENCY_YARD_FIXTURE_H_
#define STRATA_TESTS_CORE_ENGINE_CONSISTENCY_YARD_FIXTURE_H_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/simulator/worlds.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {

inline constexpr std::uint64_t kScans = 6;

// Where scan `k`, from 1, was taken: a bow through the yard, the sensor 1.2 m above its ground.
inline Pose TruthOf(std::uint64_t k) {
  const auto n = static_cast<double>(k);
  Pose pose = PoseAt(2.0 * n - 6.0, 0.1 * n * n - 2.0, 0.2 * n);
  pose.translation().z() = 1.2;
  return pose;
}

// Where it is said to have been taken; the first is right.
inline Pose SaidOf(std::uint64_t k) {
  if (k == 1) return TruthOf(1);
  const double side = k % 2 == 0 ? 1.0 : -1.0;
  return TruthOf(k) * PoseAt(0.08 * side, 0.05, 0.015 * side);
}

class YardTest : public EngineTest {
 protected:
  static PointCloud See(const Pose& T_map_scan, std::uint64_t seed) {
    static const Scene* const yard = new Scene(YardScene());
    SensorOptions sensor;
    sensor.rings = 32;
    sensor.columns = 360;
    return SimulateScan(*yard, sensor, T_map_scan, seed);
  }
  void UploadScan(std::uint64_t k, const Pose& T_map_scan, const std::string& map = kMapName) {
    const PointCloud cloud = See(TruthOf(k), k);
    STRATA_EXPECT_OK(Upload(db(), HeaderOf({"run", k}, cloud, T_map_scan), cloud, 6000, map));
  }
  void MakeWorld() {
    MakeMap(MapParameters());
    for (std::uint64_t k = 1; k <= kScans; ++k) UploadScan(k, SaidOf(k));
    WaitIntegrated(db());
  }

  // Only what scans and planes say.
  JobInfo Optimize(std::map<std::string, std::string> parameters = {}) {
    parameters.insert({"closures", "0"});
    return RunJob(db(), "optimize", parameters);
  }
  JobInfo Follow(std::uint64_t id) {
    JobInfo last;
    STRATA_EXPECT_OK(db().jobs().Watch({}, kMapName, id, [&last](const JobInfo& info) {
      last = info;
      return absl::OkStatus();
    }));
    return last;
  }

  api::PoseGraphState Graph() {
    const absl::StatusOr<api::PoseGraphState> graph = db().posegraph().Get({}, kMapName);
    EXPECT_THAT(graph, IsOk());
    return graph.value_or(api::PoseGraphState());
  }
  Pose PoseOf(std::uint64_t k) {
    const auto lookup = db().posegraph().LookupPose({}, kMapName, {"run", k});
    EXPECT_THAT(lookup, IsOk());
    return lookup.ok() ? lookup->T_map_scan : Pose::Identity();
  }
  std::vector<Pose> Poses() {
    std::vector<Pose> poses;
    for (const PoseNode& node : Graph().nodes) poses.push_back(node.T_map_scan);
    return poses;
  }
  // The largest distance from where scans are to where they are relative to the first [m].
  double Error() {
    double worst = 0.0;
    for (std::uint64_t k = 2; k <= kScans; ++k) {
      const Pose is = PoseOf(1).inverse() * PoseOf(k);
      const Pose should = TruthOf(1).inverse() * TruthOf(k);
      worst = std::max(worst, (is.translation() - should.translation()).norm());
    }
    return worst;
  }
  static void ExpectEqual(const std::vector<Pose>& a, const std::vector<Pose>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k) EXPECT_EQ(a[k].matrix(), b[k].matrix()) << k;
  }
};

}  // namespace strata::testing

#endif  // STRATA_TESTS_CORE_ENGINE_CONSISTENCY_YARD_FIXTURE_H_
