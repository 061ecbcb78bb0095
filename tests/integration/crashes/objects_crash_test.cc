// Planes and things are found, these sorted into kinds and completed, and the server is killed
// under these jobs.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/api/scans.h"
#include "core/cloud/cloud_slice.h"
#include "core/common/status.h"
#include "core/geometry/pose.h"
#include "core/world/plane_model.h"
#include "core/world/things/entity.h"
#include "core/world/things/inferred.h"
#include "tests/integration/crashes/killed_server.h"
#include "tests/support/asked.h"
#include "tests/support/simulator/scene.h"
#include "tests/support/simulator/simulator.h"
#include "tests/support/status_matchers.h"

namespace strata::testing {
namespace {

constexpr char kMap[] = "yard";
constexpr std::uint64_t kScans = 6;
constexpr std::uint16_t kGroundClass = 1, kThingClass = 2;
const JobParameters kFind = {{"class", "2"}, {"distance_m", "0.5"}};

// Two kinds of things of two boxes each, in two rows, driven past on one side.
Scene Yard() {
  Scene scene;
  scene.Add(Labelled(Box({-20, -20, -1}, {20, 20, 0}), kGroundClass));
  const auto put = [&](double x, double y, const Eigen::Vector3d& low, double width) {
    scene.Add(Labelled(Box({x, y, 0}, {x + low.x(), y + low.y(), low.z()}), kThingClass));
    const double high = low.z() + 0.5;
    scene.Add(Labelled(Box({x, y, low.z()}, {x + width, y + low.y(), high}), kThingClass));
  };
  for (int k = 0; k < 5; ++k) {
    put(-9.0 + 4.0 * k, 3.0, {1.6, 0.8, 0.6}, 0.7);
    put(-8.0 + 4.0 * k, 7.0, {0.8, 0.8, 1.2}, 0.8);
  }
  scene.Build();
  return scene;
}

// What the jobs made.
struct Outcome {
  std::vector<std::tuple<PlaneKind, double, std::size_t>> planes;
  std::vector<std::tuple<std::uint64_t, std::uint16_t, std::uint64_t, std::uint64_t>> entities;
  std::vector<InferredPart> inferred;

  std::size_t inferred_points() const {
    std::size_t points = 0;
    for (const InferredPart& part : inferred) points += part.points.size();
    return points;
  }
};

class World : public KilledServer {
 public:
  World() : KilledServer(kMap) {}

  void Prepare() {
    STRATA_ASSERT_OK(db().maps().Create({}, kMap, {}));
    const Scene scene = Yard();
    for (std::uint64_t i = 1; i <= kScans; ++i) STRATA_ASSERT_OK(Put(scene, i));
    AwaitIntegrated();
  }
  Outcome Result() {
    Outcome outcome;
    const auto keep = [&outcome](const ModelPlane& plane) {
      outcome.planes.emplace_back(plane.kind, plane.area_m2, plane.polygons.size());
      return absl::OkStatus();
    };
    STRATA_EXPECT_OK(db().models().GetPlaneModel({}, kMap, keep).status());
    STRATA_EXPECT_OK(db().objects().ListEntities({}, kMap, {}, [&](const Entity& entity) {
      const std::uint64_t kind = entity.kind.has_value() ? entity.kind->id : 0;
      outcome.entities.emplace_back(entity.id, entity.class_id, entity.points, kind);
      return absl::OkStatus();
    }));
    STRATA_EXPECT_OK(db().objects().ListInferred({}, kMap, {}, [&](const InferredPart& part) {
      outcome.inferred.push_back(part);
      return absl::OkStatus();
    }));
    return outcome;
  }

 private:
  absl::Status Put(const Scene& scene, std::uint64_t i) {
    SensorOptions sensor;
    sensor.columns = 1440;
    sensor.labelled = true;
    Pose T_map_scan = Pose::Identity();
    T_map_scan.translation() = Eigen::Vector3d(-10.0 + 3.0 * static_cast<double>(i), -1.0, 1.5);
    const PointCloud cloud = SimulateScan(scene, sensor, T_map_scan, i);
    ScanHeader header;
    header.id = {"run", i};
    header.T_map_scan = T_map_scan;
    header.alignment = Alignment::kOff;
    header.point_count = cloud.size();
    header.has_label = true;
    STRATA_ASSIGN_OR_RETURN(const auto upload, db().scans().Upload({}, kMap, header));
    for (std::size_t begin = 0; begin < cloud.size(); begin += api::kMaxPointsPerChunk) {
      const std::size_t end = std::min(begin + api::kMaxPointsPerChunk, cloud.size());
      STRATA_RETURN_IF_ERROR(upload->Write(SliceOf(cloud, begin, end)));
    }
    return upload->Finish().status();
  }
};

// Of each kind a thing, and of each thing its far side.
void ExpectKindsAndMore(const Outcome& outcome) {
  std::set<std::uint64_t> kinds;
  for (const auto& entity : outcome.entities) kinds.insert(std::get<3>(entity));
  EXPECT_FALSE(outcome.planes.empty());
  EXPECT_EQ(outcome.entities.size(), 10U);
  EXPECT_EQ(kinds.size(), 2U);
  EXPECT_EQ(outcome.inferred.size(), 10U);
  EXPECT_GT(outcome.inferred_points(), 100U);
}

TEST(ObjectsCrashTest, PlanesThingsAndWhatIsInferredOfThemAreThoseOfUndisturbedJobs) {
  const std::uint64_t kills = Asked("STRATA_KILLS", 3);
  const std::uint64_t seed = Asked("STRATA_SEED", 20261127);
  SCOPED_TRACE(absl::StrCat("seed ", seed));
  std::mt19937_64 random(seed);
  Outcome expected;
  absl::Duration undisturbed;
  {
    World world;
    ASSERT_NO_FATAL_FAILURE(world.Prepare());
    const absl::Time begun = absl::Now();
    world.Run("planes");
    world.Run("objects", kFind);
    world.Run("complete");
    undisturbed = (absl::Now() - begun) / 3;
    expected = world.Result();
  }
  ExpectKindsAndMore(expected);

  World world;
  ASSERT_NO_FATAL_FAILURE(world.Prepare());
  for (const std::string kind : {"planes", "objects", "complete"}) {
    const JobParameters parameters = kind == "objects" ? kFind : JobParameters();
    STRATA_ASSERT_OK_AND_ASSIGN(const JobInfo job,
                                world.db().jobs().Start({}, kMap, kind, parameters));
    for (std::uint64_t k = 0; k < kills; ++k) {
      const double share = std::uniform_real_distribution<double>(0.0, 1.0)(random);
      absl::SleepFor(share * undisturbed);
      world.Kill();
    }
    world.Follow(job.id);
  }
  const Outcome outcome = world.Result();
  EXPECT_EQ(outcome.planes, expected.planes);
  EXPECT_EQ(outcome.entities, expected.entities);
  EXPECT_EQ(outcome.inferred, expected.inferred);
}

}  // namespace
}  // namespace strata::testing
