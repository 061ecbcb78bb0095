// A robot that is followed through recorded worlds of which every other scan is mapped.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/engine/engine_fixture.h"
#include "tests/support/data_dir.h"
#include "tests/support/pcd.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

class TrackRecordedTest : public EngineTest {
 protected:
  struct Seen {
    Pose truth;
    PointCloud cloud;
  };

  // Maps every other one of the first `most` scans, at their reference poses, in a map that drops
  // points, and returns the rest.
  std::vector<Seen> MapEveryOther(const std::filesystem::path& folder, std::size_t most) {
    MapParameters parameters;
    parameters.keep_points = false;
    MakeMap(parameters);
    std::vector<Seen> rest;
    const auto poses = ReadIndexedPoses(folder / "poses_reference.txt");
    EXPECT_THAT(poses, IsOk());
    std::uint64_t n = 0;
    for (const auto& [index, file] : ListScans(folder / "scans")) {
      if (n == most || !poses.ok()) break;
      const Pose& truth = poses->at(index).T_world_scan;
      auto cloud = ReadBinaryPcd(file);
      EXPECT_THAT(cloud, IsOk());
      if (++n % 2 == 0) {
        rest.push_back({truth, *std::move(cloud)});
      } else {
        STRATA_EXPECT_OK(Upload(db(), HeaderOf({"mapper", n}, *cloud, truth), *cloud, 30'000));
      }
    }
    WaitIntegrated(db());
    return rest;
  }

  // The share of `seen` within these, tracked by odometry that errs by a centimetre or two and 2 %
  // of the way, and 0.5°.
  double ShareWithin(const std::vector<Seen>& seen, double most_m, double most_rad) {
    constexpr std::uint64_t kSeed = 11;
    SCOPED_TRACE(::testing::Message() << "seed " << kSeed);
    Random random(kSeed);
    TrackStart start;
    start.T_map_scan_guess = seen.front().truth;
    start.guess_radius_m = 2.0;
    auto tracking = db().posegraph().Track({}, kMapName, start);
    EXPECT_THAT(tracking, IsOk());
    Pose T_odom_scan = Pose::Identity();
    std::size_t within = 0;
    for (std::size_t k = 0; tracking.ok() && k < seen.size(); ++k) {
      if (k > 0) {
        const Pose motion = seen[k - 1].truth.inverse() * seen[k].truth;
        Vector6d noise;
        for (int i = 0; i < 6; ++i) {
          noise[i] = (i < 3 ? 0.01 : 0.02 + 0.02 * motion.translation().norm()) * random.Gaussian();
        }
        T_odom_scan = Normalized(T_odom_scan * Retract(motion, noise));
      }
      const auto pose = (*tracking)->Step({seen[k].cloud, T_odom_scan, std::nullopt});
      EXPECT_THAT(pose, IsOk());
      if (!pose.ok() || pose->state != TrackState::kTracked) continue;
      const Pose off = seen[k].truth.inverse() * pose->T_map_scan;
      within += off.translation().norm() <= most_m && RotationAngleRad(off) <= most_rad ? 1 : 0;
    }
    return static_cast<double>(within) / static_cast<double>(seen.size());
  }
};

TEST_F(TrackRecordedTest, Hall) {
  STRATA_REQUIRE_DATA(folder, "hall_livox_loop");
  const std::vector<Seen> seen = MapEveryOther(folder, 30);
  ASSERT_EQ(seen.size(), 15U);
  EXPECT_GE(ShareWithin(seen, 0.1, 0.5 * M_PI / 180.0), 0.95);
}

TEST_F(TrackRecordedTest, Campus) {
  STRATA_REQUIRE_DATA(folder, "nclt_campus_loop");
  const std::vector<Seen> seen = MapEveryOther(folder, 60);
  ASSERT_EQ(seen.size(), 30U);
  EXPECT_GE(ShareWithin(seen, 0.2, 1.0 * M_PI / 180.0), 0.95);
}

}  // namespace
}  // namespace strata::testing
